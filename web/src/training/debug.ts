/** What tests and curious people can ask about training. */

import type { RunPath, TrainingOffer, TrainingState } from "../generated/messages";
import type { Stage } from "../stage/stage";
import type { Choice } from "./choice";
import type { ButtonPlate } from "./xr/button_plate";
import type { SurveyPlate } from "./xr/survey_plate";
import type { TrialPlate } from "./xr/trial_plate";

export interface TrainingDebug {
  readonly phase: string;
  readonly state: TrainingState | null;
  readonly offer: TrainingOffer | null;
  /** What is chosen for the next trial. */
  readonly choice: Record<string, unknown>;
  /** What the plate with the trial says in a headset; empty while it is not shown. */
  readonly plate: string;
  /** What the plate with the survey asks; empty while it is not shown. */
  readonly asked: string;
  /** Where a button of a plate is, m in the room; null where there is none. */
  button(plate: "result" | "survey" | "keypad", label: string): readonly [number, number, number] | null;
  /** The instant of the run that is shown again, s; null while none is. */
  readonly replayS: number | null;
  /** Takes a state as if the server had sent it. */
  show(state: TrainingState): void;
  /** Shows a run without the server. */
  showRun(path: RunPath): void;
}

export interface Plates {
  readonly trial: TrialPlate;
  readonly result: ButtonPlate;
  readonly survey: SurveyPlate;
  readonly keypad: ButtonPlate;
}

export function trainingDebug(stage: Stage, choice: Choice, plates: Plates): TrainingDebug {
  const { training, replay } = stage;
  return {
    get phase() { return training.phase; },
    get state() { return training.state; },
    get offer() { return training.offer; },
    get choice() { return choice.args(); },
    get plate() { return plates.trial.text; },
    get asked() { return plates.survey.text; },
    button: (plate, label) => plates[plate].whereIs(label),
    get replayS() { return replay.player?.timeS ?? null; },
    show: (state) => training.takeState(state, performance.now()),
    showRun: (path) => replay.show(path),
  };
}
