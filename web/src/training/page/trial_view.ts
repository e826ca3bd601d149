/** The trial at hand in the panel: what is to be done, how it stands, and what can be done about it. */

import { make, setText } from "../../ui/dom";
import type { Desk } from "../desk";
import type { TrainingModel } from "../model";
import { countWords, errorWords, kindWords, PHASE_WORDS, runWords, timeLeft } from "../words";
import { button, DwellRing, say } from "./parts";

export class TrialView {
  readonly element = make("div", "training-trial");
  private readonly phase = make("strong", "training-phase");
  private readonly name = make("p", "training-run");
  private readonly text = make("p", "faint");
  private readonly target = make("strong", "training-target");
  private readonly how = make("p", "faint");
  private readonly count = make("span", "training-count");
  private readonly error = make("span", "training-error");
  private readonly left = make("span", "training-left");
  private readonly hindrance = make("p", "training-hindrance");
  private readonly list = make("ol", "training-targets");
  private readonly ring = new DwellRing();
  private readonly figures = make("div", "training-figures");
  private readonly start = button("Start", () => void this.desk.start(), "main");
  private readonly pause = button("Pause", () => void this.desk.pause());
  private readonly abort = button("Abort", () => void this.desk.abort());
  private readonly close = button("Put away", () => void this.desk.close());
  private readonly buttons = make("div", "training-buttons");
  private listed = "";

  constructor(private readonly model: TrainingModel, private readonly desk: Desk) {
    const words = make("div");
    words.append(this.target, this.count, this.error);
    this.figures.append(this.ring.element, words, this.left);
    this.buttons.append(this.start, this.pause, this.abort, this.close);
    const head = make("p", "training-head");
    head.append(this.phase, this.name);
    this.element.append(head, this.text, this.figures, this.how, this.hindrance, this.list, this.buttons);
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Trial");
  }

  /** Shows what has changed, figures apart. */
  show(): void {
    const { model } = this;
    const { run, phase, target } = model;
    this.element.hidden = !model.atHand;
    if (run === null || this.element.hidden) return;
    setText(this.phase, PHASE_WORDS[phase]);
    this.phase.dataset["phase"] = phase;
    setText(this.name, runWords(run));
    say(this.text, run.text);
    setText(this.target, target?.name ?? "");
    say(this.how, target === null ? "" : `To reach it, ${kindWords(target)}, for ${target.dwell_s} s.`);
    this.showButtons();
    this.showList();
    this.showFigures();
  }

  /** Shows the figures, which change with every state. */
  showFigures(): void {
    const { now, target, run } = this.model;
    if (this.element.hidden || run === null) return;
    this.ring.show(now?.progress ?? 0);
    say(this.count, now === null ? "" : countWords(now));
    say(this.error, now === null ? "" : errorWords(target, now));
    setText(this.left, timeLeft(now?.remaining_s ?? run.limit_s));
    this.left.title = "Time left";
    say(this.hindrance, this.model.phase === "running" ? now?.hindrance ?? "" : "");
  }

  private showButtons(): void {
    const { model, desk } = this;
    this.buttons.hidden = !model.operating;
    this.start.hidden = model.phase !== "ready";
    this.start.disabled = !model.can("training_begin") || desk.busy;
    this.pause.hidden = model.phase !== "running" && model.phase !== "paused";
    setText(this.pause, model.phase === "paused" ? "Go on" : "Pause");
    this.pause.disabled = !model.can(model.phase === "paused" ? "training_resume" : "training_pause") || desk.busy;
    this.abort.hidden = model.phase === "ready";
    this.abort.disabled = !model.can("training_abort") || desk.busy;
    this.close.hidden = model.phase !== "ready";
    this.close.disabled = !model.can("training_close") || desk.busy;
  }

  private showList(): void {
    const { run } = this.model;
    const key = JSON.stringify(run?.targets.map(({ key, state }) => [key, state]));
    if (key === this.listed || run === null) return;
    this.listed = key;
    this.list.replaceChildren(...run.targets.map(({ name, state }) => {
      const item = make("li", "", name);
      item.dataset["state"] = state;
      item.append(make("span", "unseen", STATE_WORDS[state]));
      return item;
    }));
    this.list.setAttribute("aria-label", "Targets");
  }
}

const STATE_WORDS = { later: ", later", now: ", now", reached: ", reached", missed: ", missed" } as const;
