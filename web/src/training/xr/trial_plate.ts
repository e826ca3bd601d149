/** The trial in a headset: countdown, target, error, dwell and time left, on a plate that follows the head at 1.2 m. */

import type { TrainingModel } from "../model";
import { countWords, errorWords, fitted, PHASE_WORDS, timeLeft } from "../words";
import { box, CanvasPlate, FONT, INK, PLATE_ORDER, write } from "../../xr/canvas_plate";
import { LazyFollower } from "../../xr/hud";

const WIDTH = 620;
const HEIGHT = 190;
/** Capitals (0.7 em) of the smaller are 1.1 degrees high at 1.2 m. */
export const TRIAL_EM = { large: 40, small: 33 } as const;
export const TRIAL_AHEAD_M = 1.2;
const UP_RAD = (9 * Math.PI) / 180;
const RING = { x: 66, y: 80, r: 42 };
const TEXT_X = 128;
/** The ring's steps: finer ones are not seen. */
const STEPS = 24;

interface Shown {
  readonly countdown: string;
  readonly title: string;
  readonly count: string;
  readonly error: string;
  readonly left: string;
  readonly note: string;
  readonly warns: boolean;
  readonly steps: number;
}

export class TrialPlate extends CanvasPlate {
  readonly follower = new LazyFollower(TRIAL_AHEAD_M, -UP_RAD);
  private shown: Shown | null = null;
  private version = "";

  constructor(private readonly model: TrainingModel) {
    super("trial", WIDTH, HEIGHT, 1.4, PLATE_ORDER - 1);
  }

  /** What it says, for tests. */
  get text(): string {
    const { shown } = this;
    return shown === null || !this.visible ? "" : [shown.countdown, shown.title, shown.count, shown.error, shown.left, shown.note].filter(Boolean).join(" | ");
  }

  /** Draws itself anew where what it says has changed. Called some ten times a second in a session. */
  update(wanted: boolean, nowMs: number): void {
    const visible = wanted && this.model.atHand;
    if (visible && !this.group.visible) this.follower.jump();
    this.group.visible = visible;
    if (!visible) return;
    const next = shownOf(this.model, nowMs);
    const version = JSON.stringify(next);
    if (version === this.version) return;
    this.version = version;
    this.shown = next;
    this.redraw();
  }

  protected paint(context: CanvasRenderingContext2D): void {
    const { shown } = this;
    if (shown === null) return;
    box(context, { x: 0, y: 0, w: WIDTH, h: HEIGHT }, 20, "rgba(16, 23, 33, 0.86)");
    if (shown.countdown !== "") {
      write(context, shown.countdown, { x: 0, y: 4, w: WIDTH, h: 132 }, 128, INK.text, "center", 750);
      write(context, shown.title, { x: 20, y: 138, w: WIDTH - 40, h: 44 }, TRIAL_EM.small, INK.soft, "center", 600);
      return;
    }
    this.paintRing(context, shown.steps / STEPS);
    const w = WIDTH - TEXT_X - 22;
    // a count is as wide as it is; the name has the rest, cut at a word: the scene's label has all of it
    context.font = `600 ${TRIAL_EM.small}px ${FONT}`;
    const right = Math.ceil(context.measureText(shown.count).width);
    const titleW = w - right - (shown.count === "" ? 0 : 16);
    const widthOf = (words: string): number => context.measureText(words).width;
    context.font = `650 ${TRIAL_EM.large}px ${FONT}`;
    const em = widthOf(shown.title) <= titleW ? TRIAL_EM.large : TRIAL_EM.small;
    context.font = `650 ${em}px ${FONT}`;
    write(context, fitted(shown.title, titleW, widthOf), { x: TEXT_X, y: 14, w: titleW, h: 52 }, em, INK.text, "left", 650);
    write(context, shown.count, { x: TEXT_X + w - right, y: 14, w: right, h: 52 }, TRIAL_EM.small, INK.soft, "right", 600);
    write(context, shown.error, { x: TEXT_X, y: 70, w: w - 130, h: 50 }, TRIAL_EM.large, INK.text, "left", 650);
    write(context, shown.left, { x: TEXT_X + w - 120, y: 70, w: 120, h: 50 }, TRIAL_EM.large, INK.text, "right", 650);
    write(context, shown.note, { x: 24, y: 130, w: WIDTH - 46, h: 48 }, TRIAL_EM.small, shown.warns ? INK.warn : INK.soft, "left", 600);
  }

  private paintRing(context: CanvasRenderingContext2D, share: number): void {
    const arc = (to: number, colour: string): void => {
      context.beginPath();
      context.arc(RING.x, RING.y - 8, RING.r, -Math.PI / 2, -Math.PI / 2 + 2 * Math.PI * to);
      context.strokeStyle = colour;
      context.lineWidth = 12;
      context.stroke();
    };
    arc(1, INK.track);
    if (share > 0) arc(share, INK.good);
  }
}

/** What there is to say now. */
function shownOf(model: TrainingModel, nowMs: number): Shown {
  const { now, target, run, phase } = model;
  const countdown = model.countdownS(nowMs);
  const running = phase === "running";
  const note = phase === "paused" ? "Paused: the time stands still"
    : phase === "ready" ? "Ready: press Start in the menu"
    : running && now !== null && now.hindrance !== "" ? now.hindrance : run?.name ?? "";
  return {
    countdown: countdown === null ? "" : countdown <= 0 ? "Go" : String(Math.ceil(countdown)),
    title: target?.name ?? run?.name ?? PHASE_WORDS[phase],
    count: now === null || phase === "ready" ? "" : countWords(now),
    error: now === null || !running ? PHASE_WORDS[phase] : errorWords(target, now),
    left: timeLeft(now?.remaining_s ?? run?.limit_s ?? 0),
    note,
    warns: phase === "paused" || (running && now !== null && now.hindrance !== ""),
    steps: Math.round(STEPS * (now?.progress ?? 0)),
  };
}
