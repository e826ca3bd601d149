/** The rows of the headset menu's tab "Training". No drawing. */

import type { Row } from "../../xr/menu_model";
import type { Choice } from "../choice";
import { VIEWS } from "../choice";
import type { Desk } from "../desk";
import type { TrainingCommand, TrainingModel } from "../model";
import type { Replay } from "../replay";
import { PAIR_FOR_HEADSET, PHASE_WORDS, runWords, taskWords, VIEW_WORDS } from "../words";

/** What a press of one of these rows' buttons does. */
export type TrainingAct =
  | "start" | "prepare" | "pause" | "abort" | "repeat" | "close" | "participant next" | "participant previous" | "code"
  | "task next" | "task previous" | "view 2d" | "view 3d" | "view free" | "result" | "survey" | "replay" | "replay stop" | "replay play";

type Button = Extract<Row, { kind: "buttons" }>["buttons"][number];

/** Letters that a line of small text has room for. */
const LINE = 54;

export interface TrainingRowsNow {
  readonly model: TrainingModel;
  readonly choice: Choice;
  readonly desk: Pick<Desk, "trouble" | "busy">;
  readonly replay: Pick<Replay, "player">;
}

export function trainingRows(now: TrainingRowsNow): Row[] {
  const { model, replay } = now;
  if (model.offer === null) return lines("This server offers no training.");
  const rows: Row[] = [];
  if (replay.player !== null) rows.push(buttons("Run", "The run is shown again: the way's colours go from early (blue) to late (yellow)", null, [
    button(replay.player.playing ? "Pause" : "Play", "replay play"), button("Back to live", "replay stop"),
  ]));
  if (!model.operating) return [...rows, ...stateRows(model), ...lines(PAIR_FOR_HEADSET)];
  const told = now.desk.trouble !== "" ? now.desk.trouble : model.state?.sentence ?? "";
  rows.push(...lines(told).slice(0, 2));
  if (model.survey !== null && !model.atHand) rows.push(buttons("Survey", model.survey.name, null, [button("Answer", "survey")]));
  if (model.atHand) return [...rows, ...stateRows(model), ...underWayRows(model)];
  if (model.result !== null && now.desk.trouble === "") rows.push(resultRow(model));
  return [...rows, ...chooserRows(now)];
}

function chooserRows({ model, choice }: TrainingRowsNow): Row[] {
  const { offer } = model;
  const cannot = may(model, "training_prepare");
  const many = (offer?.participants.length ?? 0) > 0 ? null : "Nobody is enrolled yet: type a code.";
  const rows: Row[] = [];
  const code = choice.participant === "" ? "choose" : choice.participant;
  if (choice.inStudy) {
    rows.push(buttons("Who", choice.enrolled?.next ?? choice.trouble, many, [
      button("‹", "participant previous"), button(code, "participant next"), button("›", "participant next"),
    ]));
    rows.push(...lines(choice.trouble !== "" ? choice.trouble : `Next: ${choice.enrolled?.next ?? ""}`));
  } else {
    rows.push(buttons("Who", "Participants of before, or type a code", null, [
      button("‹", "participant previous"), button(code, "code"), button("›", "participant next"), button("Type", "code"),
    ]));
    const { task } = choice;
    rows.push(buttons("Task", task?.text ?? "", task === null ? "There is no task for this heart." : null, [
      button("‹", "task previous"), button(task === null ? "none" : taskWords(task), "task next"), button("›", "task next"),
    ]));
    rows.push(buttons("View", "What the participant may see", null, VIEWS.map(({ value, label }) => button(label, `view ${value}`, choice.view === value))));
  }
  const trouble = choice.trouble === "" ? null : choice.trouble;
  rows.push(buttons("Trial", choice.task?.text ?? "", cannot ?? trouble, [button("Start", "start"), button("Prepare", "prepare")]));
  return rows;
}

function underWayRows(model: TrainingModel): Row[] {
  const { phase } = model;
  if (phase === "ready") return [buttons("Trial", "Counts down from three", may(model, "training_begin"), [button("Start", "start"), button("Put away", "close")])];
  if (phase === "countdown") return [buttons("Trial", "", may(model, "training_abort"), [button("Abort", "abort")])];
  const paused = phase === "paused";
  return [buttons("Trial", "", may(model, paused ? "training_resume" : "training_pause"), [button(paused ? "Go on" : "Pause", "pause"), button("Abort", "abort")])];
}

function resultRow(model: TrainingModel): Row {
  const all: Button[] = [button("Result", "result")];
  if (model.can("training_repeat")) all.push(button("Repeat", "repeat"));
  if ((model.result?.run ?? null) !== null) all.push(button("Show the run", "replay"));
  return buttons("Last trial", model.result?.sentence ?? "", null, all);
}

function stateRows(model: TrainingModel): Row[] {
  const { run, phase } = model;
  if (run === null || !model.atHand) return model.result === null ? [] : lines(model.result.sentence);
  return lines(`${PHASE_WORDS[phase]}: ${runWords(run)}${run.condition === "" ? "" : `, ${VIEW_WORDS[run.view]}`}`);
}

/** Why a command would be refused now; null when it would not. */
function may(model: TrainingModel, command: TrainingCommand): string | null {
  return model.can(command) ? null : model.linked ? "Not now." : "There is no link to the server.";
}

function button(label: string, what: TrainingAct, chosen = false): Button {
  return { label, act: { training: what }, chosen };
}

function buttons(label: string, help: string, locked: string | null, all: readonly Button[]): Row {
  return { kind: "buttons", label, help, locked, buttons: all };
}

/** Returns a text in rows of lines that can be read. */
export function lines(text: string): Row[] {
  const rows: string[] = [];
  for (const word of text.trim().split(" ")) {
    const last = rows.at(-1);
    if (last === undefined || last.length + word.length + 1 > LINE) rows.push(word);
    else rows[rows.length - 1] = `${last} ${word}`;
  }
  return rows.filter((row) => row !== "").map((label) => ({ kind: "text", label, help: "", locked: null }));
}
