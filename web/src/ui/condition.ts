/** What to tell the person, from the link, the newest Track and the sources' health: one thing at a time. */

import type { HealthMessage, TrackMessage } from "../generated/messages";
import type { LinkState } from "../link/link";
import { sentence } from "../maths/format";

export type Level = "idle" | "good" | "warn" | "bad";

export interface Banner {
  readonly level: Level;
  readonly title: string;
  readonly detail: string;
  readonly hint: string;
  /** Whether the person may ask for another attempt now. */
  readonly retry: boolean;
}

export interface Condition {
  readonly label: string;
  readonly level: Level;
  readonly banner: Banner | null;
  /** Whether what is drawn is no longer what is. */
  readonly stale: boolean;
}

export interface Situation {
  readonly link: LinkState;
  readonly track: TrackMessage | null;
  /** Since the newest Track came, or since the link opened when none has; ms. */
  readonly trackAgeMs: number;
  readonly health: HealthMessage | null;
  readonly nowMs: number;
}

/** Tracks come at 30 Hz and more: a gap this long is no jitter. */
export const SILENT_MS = 1500;
/** Cameras need a while to open when the server has just been started. */
export const FIRST_MS = 8000;

/** Returns the one thing that matters most now. */
export function condition(now: Situation): Condition {
  if (now.link.phase !== "live") return linkCondition(now.link, now.nowMs, now.track !== null);
  if (now.track === null || now.trackAgeMs > SILENT_MS) return silentCondition(now);
  const { track } = now;
  if (track.status === "tracked") return { label: "tracked", level: "good", banner: null, stale: false };
  if (track.status === "coasting") {
    return {
      label: track.reason === "" ? "coasting" : `coasting: ${track.reason}`,
      level: "warn",
      banner: null,
      stale: false,
    };
  }
  return {
    label: "lost",
    level: "bad",
    banner: {
      level: "bad",
      title: "The catheter is lost",
      detail: sentence(track.reason),
      hint: hintFor(track.reason),
      retry: false,
    },
    stale: false,
  };
}

/** Returns what to say about a link that is not live. `shown`: whether the page shows something that came over it. */
export function linkCondition(link: LinkState, nowMs: number, shown: boolean): Condition {
  if (link.phase === "connecting") {
    return { label: "connecting", level: "idle", banner: null, stale: false };
  }
  const seconds = link.retryAtMs === null ? 0 : Math.max(0, Math.ceil((link.retryAtMs - nowMs) / 1000));
  const next = seconds > 0 ? `Trying again in ${seconds} s.` : "Trying again now.";
  const refused = link.phase === "refused";
  return {
    label: refused ? "refused" : "link lost",
    level: "bad",
    banner: {
      level: "bad",
      title: refused ? "The server refused the link" : shown ? "The link is lost" : "No link to the server",
      detail: sentence(link.sentence),
      hint: !shown || refused ? next : `${next} What is drawn is the last that came.`,
      retry: true,
    },
    stale: shown,
  };
}

function silentCondition({ track, trackAgeMs, health }: Situation): Condition {
  const failing = health?.sources.find((source) => !source.running || source.last_error !== null);
  if (track === null && failing === undefined && trackAgeMs <= FIRST_MS) {
    return { label: "waiting for pictures", level: "idle", banner: null, stale: false };
  }
  const detail = failing === undefined
    ? `No picture pair for ${Math.floor(trackAgeMs / 1000)} s.`
    : sentence(`${failing.source}: ${failing.last_error ?? "not running"}`);
  return {
    label: "no pictures",
    level: "bad",
    banner: {
      level: "bad",
      title: track === null ? "No pictures yet" : "No new pictures",
      detail,
      hint: failing === undefined ? "Check the cameras' cables; the sources are listed under System." : "It is tried again by itself.",
      retry: false,
    },
    stale: track !== null,
  };
}

const HINTS: readonly (readonly [RegExp, string])[] = [
  [/frozen|same picture|repeat/i, "The camera sends the same picture again and again: unplug it and plug it in."],
  [/black|dark picture/i, "Switch the back-light on and take the lens cap off."],
  [/white picture|saturat|overexpos/i, "Turn the back-light or the exposure down."],
  [/no picture/i, "Check that camera's cable: it comes back by itself."],
  [/two|blobs|more than one|several|ambiguous/i, "Take everything but the catheter out of the box."],
  [/disagree|inconsistent|match|epipolar|mismatch/i, "Both views must see the same catheter: take other objects out, and calibrate again if a camera was moved."],
  [/out of|outside|leaves|cut off|edge/i, "Pull the catheter back until both cameras see its tip."],
  [/no catheter|not found|nothing/i, "Push the catheter in through the inlet until both cameras see it."],
];

/** Returns what a person can do about a lost catheter. */
export function hintFor(reason: string): string {
  const found = HINTS.find(([pattern]) => pattern.test(reason));
  return found?.[1] ?? "Tracking goes on by itself once both cameras see the whole catheter.";
}

/** What is said while the graphics card has taken the picture away: nothing else matters then. */
export const GRAPHICS_LOST: Condition = {
  label: "no picture",
  level: "bad",
  stale: true,
  banner: {
    level: "bad",
    title: "The graphics card has stopped drawing",
    detail: "The browser took it away, as when a driver starts anew or another program needs it. A headset's session was ended.",
    hint: "The picture comes back by itself. If it does not within a minute, load the page again.",
    retry: false,
  },
};
