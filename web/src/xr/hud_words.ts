/** What the numbers beside the scene say. No drawing. */

import type { TargetReadout, WallReadout } from "../scene/target_readout";

export type Tone = "idle" | "good" | "warn" | "bad" | "text" | "soft";

export interface Word {
  readonly text: string;
  readonly tone: Tone;
}

/** A line has a left and a right end. */
export interface Line {
  readonly left: Word;
  readonly right: Word | null;
}

export interface HudFigures {
  /** As the page's status has it. */
  readonly status: { readonly label: string; readonly level: "idle" | "good" | "warn" | "bad" };
  readonly insertedMm: number | null;
  readonly rollRad: number | null;
  /** Whether the wearer can put a roll right that is not valid. */
  readonly canMendRoll: boolean;
  readonly delayMs: number | null;
  readonly target: TargetReadout | null;
  readonly wall: WallReadout;
}

export function hudLines(now: HudFigures): Line[] {
  const delay = now.delayMs === null ? null : soft(`${Math.round(now.delayMs)} ms behind`);
  const lines: Line[] = [{ left: { text: capital(now.status.label), tone: now.status.level }, right: delay }];
  if (now.insertedMm !== null) {
    const unknown: Word = now.canMendRoll ? { text: "roll not valid: see the menu", tone: "warn" } : soft("roll unknown");
    const roll = now.rollRad === null ? unknown : text(`roll ${degrees((now.rollRad * 180) / Math.PI)}`);
    lines.push({ left: text(`${Math.round(now.insertedMm)} mm inserted`), right: roll });
  }
  if (now.target !== null) lines.push(...targetLines(now.target));
  if (now.wall.state === "ready" && now.wall.count > 0) {
    lines.push({ left: { text: `In the wall, ${now.wall.depthMm.toFixed(1)} mm deep`, tone: "warn" }, right: null });
  }
  return lines;
}

/** What counts comes first, the other pair of figures softly beside it. */
function targetLines(target: TargetReadout): Line[] {
  const tip = `tip ${millimetres(target.distanceMm)} ${degrees(target.angleDeg)}`;
  const { beamDistanceMm, beamAngleDeg } = target;
  const beam = beamDistanceMm === null || beamAngleDeg === null ? "beam unknown" : `beam ${millimetres(beamDistanceMm)} ${degrees(beamAngleDeg)}`;
  const [counts, other] = target.by === "tip" ? [tip, beamDistanceMm === null ? null : beam] : [beam, tip];
  const tone = target.reached || target.within ? "good" : "text";
  const name = target.reached ? `${target.name}: reached` : `To ${target.name}`;
  return [
    { left: { text: name, tone }, right: null },
    { left: { text: counts, tone }, right: other === null ? null : soft(other) },
  ];
}

function millimetres(value: number): string {
  return `${value.toFixed(value < 9.95 ? 1 : 0)} mm`;
}

function degrees(value: number): string {
  return `${Math.round(value)}°`.replace("-", "−");
}

function capital(label: string): string {
  return label.charAt(0).toUpperCase() + label.slice(1);
}

function text(words: string): Word {
  return { text: words, tone: "text" };
}

function soft(words: string): Word {
  return { text: words, tone: "soft" };
}

/** What nobody must miss, in three lines. */
export interface NoticeWords {
  readonly title: string;
  readonly detail: string;
  readonly hint: string;
}

/** Returns what is to be said large in a headset: that nothing new comes. null: nothing. `now` as the page's banner has it. */
export function noticeOf(now: { readonly label: string; readonly banner: NoticeWords | null }): NoticeWords | null {
  if (now.banner === null || now.label === "lost") return null; // a lost catheter is said by the numbers
  if (now.label !== "link lost") return now.banner;
  const [next, ...rest] = now.banner.hint.split(/(?<=\.) /);
  return { title: "Link lost, trying again", detail: next ?? "", hint: rest.join(" ") };
}
