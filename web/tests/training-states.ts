/** Messages of training for tests: enough of each to be complete, anything changed at will. */

import type {
  CardLineMessage, RunPath, SurveyDescription, SurveyItem, TrainingNow, TrainingOffer, TrainingRun, TrainingState, TrainingTarget,
} from "../src/generated/messages";

export function target(key: string, change: Partial<TrainingTarget> = {}): TrainingTarget {
  return {
    key, name: key.toUpperCase(), kind: "tip", position_mm: [60, 0, 0], radius_mm: 5, angle_deg: null, direction: null, up: null, dwell_s: 1,
    state: "later", ...change,
  };
}

export function run(change: Partial<TrainingRun> = {}): TrainingRun {
  return {
    id: "trial-1", participant: "P01", task: "six", name: "Six targets", text: "Reach them.", view: "3d", condition: "", number: 2,
    practice: false, limit_s: 120, targets: [target("a", { state: "now" }), target("b")], ...change,
  };
}

export function figures(change: Partial<TrainingNow> = {}): TrainingNow {
  return {
    target: "a", number: 1, of: 2, reached: 0, in_a_row: 0, wanted_in_a_row: null, progress: 0, distance_mm: 12.34, angle_deg: null,
    up_deg: null, hindrance: "", active_s: 10, remaining_s: 110, target_remaining_s: null, ...change,
  };
}

export function state(change: Partial<TrainingState> = {}): TrainingState {
  return {
    type: "training", phase: "idle", countdown_s: null, run: null, now: null, result: null, survey: null, sentence: "",
    can: ["training_prepare"], ...change,
  };
}

export function offer(change: Partial<TrainingOffer> = {}): TrainingOffer {
  const task = { text: "Do it.", step: null, practice: false, problem: "", view: "3d" } as const;
  return {
    type: "training_offer", study: null, unfinished: [],
    tasks: [{ ...task, key: "one", name: "One", view: "2d" }, { ...task, key: "two", name: "Two" }, { ...task, key: "bad", name: "Bad", problem: "No landmark." }],
    participants: [{ code: "P01", next: "", done: false }, { code: "P02", next: "", done: false }], ...change,
  };
}

export function line(change: Partial<CardLineMessage> = {}): CardLineMessage {
  return {
    key: "t", name: "Time", unit: "s", better: "lower", value: 40, reason: "", history: [[1, 60], [2, 40]], best_before: 60, is_best: true,
    percentile: null, others: 0, ...change,
  };
}

export function item(key: string, change: Partial<SurveyItem> = {}): SurveyItem {
  return {
    key, text: `About ${key}?`, kind: "rating", minimum: 1, maximum: 5, step: 1, low: "no", high: "yes", labels: [], optional: false, ...change,
  };
}

export function survey(items: SurveyItem[], answers: SurveyDescription["answers"] = {}): SurveyDescription {
  return { participant: "P01", survey: "own", name: "Own", instruction: "Answer.", source: "", occasion: "end", items, answers };
}

/** A run of two seconds along x at 10 mm/s, the tip not seen from 0.95 to 1.25 s. */
export function path(): RunPath {
  const t = Array.from({ length: 41 }, (_, i) => i / 20);
  const seen = (s: number): boolean => s < 0.95 || s > 1.25;
  const at = (s: number): [number, number, number] => [50 + 10 * s, 0, 0];
  return {
    id: "r", participant: "P01", task: "six", t, tip: t.map((s) => (seen(s) ? at(s) : null)), beam: t.map((s) => (seen(s) ? [0, -1, 0] : null)),
    shape: t.map((s) => (seen(s) ? [at(s), [25, 0, 0], [0, 0, 0]] : null)), targets: [target("a"), target("b")], reached: [["a", 0.5], ["b", 1.9]],
  };
}
