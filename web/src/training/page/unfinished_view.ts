/** Trials that the program ended under: each can be gone on with, or marked invalid. */

import type { UnfinishedTrial } from "../../generated/messages";
import { make } from "../../ui/dom";
import type { Desk } from "../desk";
import type { TrainingModel } from "../model";
import { markForm } from "./mark_form";
import { button } from "./parts";

export class UnfinishedView {
  readonly element = make("section", "training-unfinished");
  private readonly list = make("ul");
  private shown = "";

  constructor(private readonly model: TrainingModel, private readonly desk: Desk) {
    this.element.append(make("h3", "", "Unfinished"), this.list);
    this.element.setAttribute("aria-label", "Unfinished trials");
  }

  show(): void {
    const { model } = this;
    const trials = model.offer?.unfinished ?? [];
    this.element.hidden = trials.length === 0 || model.atHand;
    const key = JSON.stringify([trials, model.operating, model.can("training_continue"), model.can("training_mark")]);
    if (key === this.shown) return;
    this.shown = key;
    this.list.replaceChildren(...trials.map((trial) => this.row(trial)));
  }

  private row(trial: UnfinishedTrial): HTMLLIElement {
    const { model, desk } = this;
    const item = make("li");
    item.append(make("strong", "", `${trial.participant} · ${trial.task}`), make("span", "faint", beganWords(trial.began)), make("p", "", trial.sentence));
    if (!model.operating) return item;
    const buttons = make("div", "training-buttons");
    const goOn = button("Go on", () => void desk.goOn(trial.id), "main");
    goOn.disabled = !trial.can_continue || !model.can("training_continue");
    goOn.setAttribute("aria-label", `Go on with ${trial.participant}, ${trial.task}`);
    if (!trial.can_continue) goOn.title = "Its recording does not hold enough to go on with";
    buttons.append(goOn, markForm(`${trial.participant}, ${trial.task},`, `mark-${trial.id}`, (reason) => desk.mark(trial.id, reason)));
    item.append(buttons);
    return item;
  }
}

function beganWords(began: string): string {
  const at = new Date(began);
  return Number.isNaN(at.getTime()) ? began : at.toLocaleString(undefined, { dateStyle: "medium", timeStyle: "short" });
}
