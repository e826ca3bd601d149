/** The words and figures of training, for page and headset alike. */

import type { CardLineMessage, TrainingNow, TrainingResult, TrainingRun, TrainingTarget, TrainingTask } from "../generated/messages";
import { duration, fixed, NO_VALUE } from "../maths/format";
import type { Phase, View } from "./model";

export const VIEW_WORDS: Readonly<Record<View, string>> = { "2d": "2D view", "3d": "3D view", free: "any view" };

export const PHASE_WORDS: Readonly<Record<Phase, string>> = {
  idle: "No trial", ready: "Ready", countdown: "Starts now", running: "Runs", paused: "Paused", ended: "Ended",
};

/** Why a viewer sees no buttons, and how to get some. */
export const PAIR_ON_PAGE = "Viewing only: enter the pairing code that the server's console shows to start trials from here.";
export const PAIR_FOR_HEADSET =
  "Viewing only. Leave the headset view, enter the pairing code of the server's console on the page, and come back.";
export const WORDS_ON_PAGE = "Questions to be answered in words are asked on the page.";

/** The first part of a name, for places that are narrow: "Home view" of "Home view: tricuspid valve, right ventricle". */
export function shortName(name: string): string {
  return name.split(/[:,]/, 1)[0]?.trim() || name;
}

/** Words cut at a word's end so that they fit, with an ellipsis then. widthOf: of some words, as they are written. */
export function fitted(text: string, width: number, widthOf: (words: string) => number): string {
  if (widthOf(text) <= width) return text;
  const words = text.split(" ");
  while (words.length > 1) {
    words.pop();
    const shorter = `${words.join(" ").replace(/[:,]$/, "")} …`;
    if (widthOf(shorter) <= width) return shorter;
  }
  return words[0] ?? text;
}

/** Seconds as they are counted down: whole, "1:05" from a minute on. */
export function timeLeft(seconds: number): string {
  const whole = Math.ceil(Math.max(0, seconds) - 1e-9);
  return whole < 60 ? `${whole} s` : duration(whole);
}

/** How long a trial took: rounded, as its figures are, "1:05" from a minute on. */
export function tookWords(seconds: number): string {
  const whole = Math.round(Math.max(0, seconds));
  return whole < 60 ? `${fixed(seconds, 1)} s` : duration(whole);
}

/** Which target it is of how many: "2 of 6"; in practice how many in a row. */
export function countWords(now: TrainingNow): string {
  if (now.wanted_in_a_row !== null) return `${now.in_a_row} of ${now.wanted_in_a_row} in a row`;
  return now.of === null ? `target ${now.number}` : `${now.number} of ${now.of}`;
}

/** How far it is, as what counts for a kind of target has it; a dash each where nothing is seen. */
export function errorWords(target: TrainingTarget | null, now: TrainingNow): string {
  const far = `${now.distance_mm === null ? NO_VALUE : fixed(now.distance_mm, now.distance_mm < 9.95 ? 1 : 0)} mm`;
  const needsAngle = target !== null && (target.angle_deg !== null || target.kind === "plane");
  const angle = needsAngle ? ` · ${now.angle_deg === null ? NO_VALUE : fixed(now.angle_deg, 0)}°` : "";
  const up = target?.kind === "plane" && now.up_deg !== null ? ` · beam ${fixed(now.up_deg, 0)}°` : "";
  return `${far}${angle}${up}`;
}

/** What has to come to a target. */
export function kindWords(target: TrainingTarget): string {
  if (target.kind === "tip") return `bring the tip within ${fixed(target.radius_mm, 0)} mm`;
  const angle = target.angle_deg === null ? "" : ` and ${fixed(target.angle_deg, 0)}°`;
  const what = target.kind === "beam" ? "point the beam at it" : "turn the image plane into the frame";
  return `${what}, within ${fixed(target.radius_mm, 0)} mm${angle}`;
}

/** One line that names a trial: whose, what, under which condition, the how manieth. */
export function runWords(run: TrainingRun): string {
  const condition = run.condition === "" ? VIEW_WORDS[run.view] : run.condition;
  return `${run.participant} · ${run.name} · ${condition}${run.practice ? " · practice" : ` · trial ${run.number}`}`;
}

/** A task's place in the progression, before its name. */
export function taskWords(task: TrainingTask): string {
  return `${task.step === null ? "" : `${task.step}. `}${task.name}${task.practice && !/practice/i.test(task.name) ? " (practice)" : ""}`;
}

/** A value with its unit, as many digits as people read. */
export function valueWords(value: number | null, unit: string): string {
  if (value === null) return NO_VALUE;
  const size = Math.abs(value);
  const text = fixed(value, size >= 100 || (unit === "" && Number.isInteger(value)) ? 0 : size >= 10 ? 1 : 2);
  return unit === "" || unit === "1" ? text : unit === "°" || unit === "%" ? `${text}${unit === "%" ? " " : ""}${unit}` : `${text} ${unit}`;
}

/** What a metric's arrow says: which way is better. */
export const BETTER: Readonly<Record<CardLineMessage["better"], { readonly arrow: string; readonly words: string }>> = {
  lower: { arrow: "↓", words: "lower is better" },
  higher: { arrow: "↑", words: "higher is better" },
  neither: { arrow: "", words: "neither is better" },
};

/** How a value stands against one's own best and the others: as few words as possible. */
export function standingWords(line: CardLineMessage): string {
  const parts: string[] = [];
  if (line.value === null) return line.reason;
  if (line.is_best && line.best_before !== null) parts.push(`own best, before ${valueWords(line.best_before, line.unit)}`);
  else if (line.best_before !== null && line.better !== "neither") parts.push(`own best ${valueWords(line.best_before, line.unit)}`);
  else if (line.history.length <= 1) parts.push("first trial");
  if (line.percentile !== null) parts.push(`better than ${fixed(line.percentile, 0)} % of ${line.others} others`);
  return parts.join(" · ");
}

/** Whether a value is better, worse or as good as the best before; null where that cannot be said. */
export function trend(line: CardLineMessage): "better" | "worse" | null {
  if (line.value === null || line.better === "neither" || line.history.length < 2) return null;
  const before = line.history.at(-2)![1];
  if (line.value === before) return null;
  return line.value > before === (line.better === "higher") ? "better" : "worse";
}

/** The lines that a small plate has room for: the times first, then what can be better or worse. */
export function chiefLines(lines: readonly CardLineMessage[], most: number): CardLineMessage[] {
  const known = lines.filter(({ value, better }) => value !== null && better !== "neither");
  const rank = ({ key }: CardLineMessage): number => {
    const at = CHIEF.indexOf(key);
    return at < 0 ? CHIEF.length : at;
  };
  return known.map((line, at) => ({ line, at })).sort((a, b) => rank(a.line) - rank(b.line) || a.at - b.at).slice(0, most).map(({ line }) => line);
}

const CHIEF: readonly string[] = ["t", "path_length", "path_inefficiency", "breach_count", "sparc", "rotation_total", "idle_time"];

/** A result's title. */
export function outcomeWords({ outcome, reached, of }: TrainingResult): string {
  const share = `${reached} of ${of}`;
  if (outcome === "completed") return `Done: ${share} targets`;
  if (outcome === "timed_out") return `Time is over: ${share} targets`;
  return outcome === "aborted" ? `Aborted after ${share} targets` : `Interrupted after ${share} targets`;
}
