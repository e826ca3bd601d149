/** Whose trial, which task, which view: the form that a trial is started from. */

import { make, setText } from "../../ui/dom";
import type { Choice } from "../choice";
import { VIEWS } from "../choice";
import { asCode, codeTrouble } from "../code";
import type { Desk } from "../desk";
import type { TrainingModel } from "../model";
import { taskWords, VIEW_WORDS } from "../words";
import { button, field, say } from "./parts";

export class Chooser {
  readonly element = make("form", "training-chooser");
  private readonly participants = make("select");
  private readonly code = make("input");
  private readonly codeNote = make("p", "trouble");
  private readonly next = make("p", "training-next");
  private readonly tasks = make("select");
  private readonly text = make("p", "faint");
  private readonly problem = make("p", "trouble");
  private readonly views = make("div", "segments");
  private readonly radios: HTMLInputElement[];
  private readonly participantRow: HTMLElement;
  private readonly codeRow: HTMLElement;
  private readonly taskRow: HTMLElement;
  private readonly viewRow = make("div", "training-field");
  private readonly start = make("button", "main", "Start");
  private readonly ready = button("Prepare", () => void this.desk.prepare());
  private listed = "";

  constructor(private readonly model: TrainingModel, private readonly choice: Choice, private readonly desk: Desk) {
    this.participantRow = field("Participant", this.participants, "training-participant");
    this.codeRow = field("Participant", this.code, "training-code");
    this.taskRow = field("Task", this.tasks, "training-task");
    this.radios = VIEWS.map(({ value, label }) => this.radio(value, label));
    this.build();
    this.wire();
  }

  show(): void {
    const { model, choice } = this;
    const study = choice.inStudy;
    this.list();
    this.participantRow.hidden = !study;
    this.codeRow.hidden = study;
    this.participants.value = choice.participant;
    if (document.activeElement !== this.code) this.code.value = choice.participant;
    say(this.next, study ? nextWords(choice) : "");
    this.taskRow.hidden = this.viewRow.hidden = study;
    this.tasks.value = choice.task?.key ?? "";
    say(this.text, study ? "" : choice.task?.text ?? "");
    say(this.problem, study ? "" : choice.task?.problem ?? "");
    for (const radio of this.radios) radio.checked = radio.value === choice.view;
    const able = model.can("training_prepare");
    this.start.disabled = this.ready.disabled = !able || this.desk.busy;
  }

  private build(): void {
    this.code.name = "participant";
    this.code.autocomplete = "off";
    this.code.maxLength = 12;
    this.code.placeholder = "P01";
    this.code.setAttribute("list", "training-codes");
    this.code.setAttribute("aria-describedby", "training-code-note");
    this.code.setAttribute("autocapitalize", "characters");
    this.code.spellcheck = false;
    this.codeNote.id = "training-code-note";
    this.codeNote.hidden = true;
    this.codeNote.setAttribute("role", "alert");
    this.views.setAttribute("role", "radiogroup");
    this.views.setAttribute("aria-label", "View");
    this.viewRow.append(make("span", "", "View"), this.views);
    this.start.type = "submit";
    this.start.title = "Makes it ready, counts down and begins";
    this.ready.title = "Shows the targets and holds the view; Start then begins";
    const codes = make("datalist");
    codes.id = "training-codes";
    const buttons = make("div", "training-buttons");
    buttons.append(this.start, this.ready);
    this.element.append(
      this.participantRow, this.codeRow, codes, this.codeNote, this.next, this.taskRow, this.text, this.problem, this.viewRow, buttons,
    );
    this.element.setAttribute("aria-label", "Next trial");
  }

  private wire(): void {
    const { choice } = this;
    this.element.addEventListener("submit", (event) => {
      event.preventDefault();
      this.judge(true);
      if (this.codeNote.hidden) void this.desk.start();
      else this.code.focus();
    });
    this.participants.addEventListener("change", () => (choice.participant = this.participants.value));
    this.code.addEventListener("input", () => {
      choice.participant = this.code.value;
      this.judge(false);
    });
    this.code.addEventListener("change", () => {
      this.code.value = asCode(this.code.value);
      this.judge(true);
    });
    this.tasks.addEventListener("change", () => choice.chooseTask(this.tasks.value));
  }

  /** Says why what is typed is no code: at once where it was said already, else once it is through. */
  private judge(through: boolean): void {
    if (this.choice.inStudy || (!through && this.codeNote.hidden)) return;
    const typed = asCode(this.code.value);
    say(this.codeNote, typed === "" ? "" : codeTrouble(typed));
    this.code.setAttribute("aria-invalid", String(!this.codeNote.hidden));
  }

  private radio(value: string, label: string): HTMLInputElement {
    const choice = make("label");
    const radio = make("input");
    radio.type = "radio";
    radio.name = "training-view";
    radio.value = value;
    radio.addEventListener("input", () => (this.choice.view = value as Choice["view"]));
    choice.title = VIEW_WORDS[value as Choice["view"]];
    choice.append(radio, make("span", "", label));
    this.views.append(choice);
    return radio;
  }

  /** Fills the lists where what is offered has changed. */
  private list(): void {
    const { offer } = this.model;
    const key = JSON.stringify([offer?.participants, offer?.tasks]);
    if (key === this.listed) return;
    this.listed = key;
    const people = (offer?.participants ?? []).map(({ code, done }) => option(code, `${code}${done ? " (done)" : ""}`));
    this.participants.replaceChildren(...people);
    this.element.querySelector("datalist")!.replaceChildren(...(offer?.participants ?? []).map(({ code }) => option(code, code)));
    this.tasks.replaceChildren(...(offer?.tasks ?? []).map((task) => option(task.key, taskWords(task))));
    setText(this.start, "Start");
  }
}

function option(value: string, label: string): HTMLOptionElement {
  const made = make("option", "", label);
  made.value = value;
  return made;
}

/** What the study has for whom is chosen. */
function nextWords(choice: Choice): string {
  const { enrolled } = choice;
  if (enrolled === null) return choice.trouble;
  return enrolled.done ? "All trials are done." : `Next: ${enrolled.next}`;
}
