/** A survey as a form: every item a group of radio buttons or a field, by keyboard and screen reader. */

import type { SurveyDescription, SurveyItem } from "../../generated/messages";
import { make, setText } from "../../ui/dom";
import type { Desk } from "../desk";
import type { TrainingModel } from "../model";
import { labelOf, missing, surveyId, valuesOf } from "../survey";
import { button, say } from "./parts";

/** More buttons than these stand close, their numbers only where there is room. */
const FEW = 11;

export class SurveyDialog {
  /** The row of the panel that says that a survey is due. */
  readonly row = make("div", "training-survey-due");
  private readonly due = make("p");
  private readonly open = button("Answer here", () => this.show(true), "main");
  private readonly dialog = make("dialog", "survey");
  private readonly title = make("h2");
  private readonly instruction = make("p");
  private readonly form = make("form");
  private readonly items = make("div", "survey-items");
  private readonly trouble = make("p", "trouble");
  private readonly progress = make("span", "faint");
  private readonly send = make("button", "main", "Hand in");
  private readonly source = make("p", "faint");
  private survey: SurveyDescription | null = null;
  private built = "";

  constructor(private readonly model: TrainingModel, private readonly desk: Desk) {
    this.title.id = "survey-title";
    this.dialog.id = "survey";
    this.dialog.setAttribute("aria-labelledby", this.title.id);
    this.trouble.setAttribute("role", "alert");
    this.send.type = "submit";
    this.form.noValidate = true;
    const foot = make("div", "survey-foot");
    foot.append(this.progress, button("Later", () => this.dialog.close()), this.send);
    this.form.append(this.items, this.trouble, foot);
    this.dialog.append(this.title, this.instruction, this.form, this.source);
    document.body.append(this.dialog);
    this.row.append(this.due, this.open);
    this.form.addEventListener("submit", (event) => {
      event.preventDefault();
      void this.handIn();
    });
    this.form.addEventListener("input", () => this.showProgress());
  }

  update(): void {
    const { survey, operating } = this.model;
    this.survey = survey;
    this.row.hidden = survey === null;
    if (survey === null) {
      if (this.dialog.open) this.dialog.close(); // answered elsewhere
      this.built = "";
      return;
    }
    const given = Object.keys(survey.answers).length;
    setText(this.due, `Survey for ${survey.participant}: ${survey.name}${given > 0 ? `, ${given} of ${survey.items.length} answered` : ""}`);
    this.open.hidden = !operating;
    if (this.dialog.open && surveyId(survey) !== this.built) this.show(true);
  }

  private show(opened: boolean): void {
    const { survey } = this;
    if (survey === null || !opened) return;
    const id = surveyId(survey);
    if (id !== this.built) {
      this.built = id;
      setText(this.title, survey.name);
      say(this.instruction, survey.instruction);
      say(this.source, survey.source === "" ? "" : `Source: ${survey.source}`);
      this.items.replaceChildren(...survey.items.map((item, at) => makeItem(item, at)));
      say(this.trouble, "");
    }
    this.fill(survey);
    this.showProgress();
    if (!this.dialog.open) this.dialog.showModal();
    this.items.querySelector<HTMLElement>("input:not([type=radio]), input[type=radio], textarea")?.focus();
    this.dialog.scrollTop = 0;
  }

  /** Fills in what was answered already, in a headset for example. */
  private fill({ items, answers }: SurveyDescription): void {
    for (const { key, kind } of items) {
      const given = answers[key];
      if (given === undefined) continue;
      if (kind === "words") {
        const field = this.form.elements.namedItem(key) as HTMLTextAreaElement;
        if (field.value === "") field.value = String(given);
      } else if (this.form.querySelector(`input[name="${CSS.escape(key)}"]:checked`) === null) {
        const radio = this.form.querySelector<HTMLInputElement>(`input[name="${CSS.escape(key)}"][value="${CSS.escape(String(given))}"]`);
        if (radio !== null) radio.checked = true;
      }
    }
  }

  private answers(): Record<string, number | string> {
    const given: Record<string, number | string> = {};
    const data = new FormData(this.form);
    for (const { key, kind } of this.survey?.items ?? []) {
      const value = data.get(key);
      if (typeof value === "string" && value.trim() !== "") given[key] = kind === "rating" ? Number(value) : value.trim();
    }
    return given;
  }

  private showProgress(): void {
    if (this.survey === null) return;
    const given = Object.keys(this.answers()).length;
    setText(this.progress, `${given} of ${this.survey.items.length}`);
    for (const item of this.items.querySelectorAll<HTMLElement>("[data-missing]")) {
      if (this.answers()[item.dataset["key"]!] !== undefined) delete item.dataset["missing"];
    }
  }

  private async handIn(): Promise<void> {
    const { survey } = this;
    if (survey === null) return;
    const answers = this.answers();
    const left = missing(survey, answers);
    for (const item of this.items.querySelectorAll<HTMLElement>("[data-key]")) {
      if (left.includes(item.dataset["key"]!)) item.dataset["missing"] = "";
      else delete item.dataset["missing"];
    }
    if (left.length > 0) {
      say(this.trouble, left.length === 1 ? "One question is not answered yet: it is marked." : `${left.length} questions are not answered yet: they are marked.`);
      const first = this.items.querySelector<HTMLElement>("[data-missing]");
      first?.scrollIntoView({ block: "center" });
      first?.querySelector<HTMLElement>("input, textarea")?.focus();
      return;
    }
    this.send.disabled = true;
    const done = await this.desk.answer(survey.survey, survey.occasion, answers, true);
    this.send.disabled = false;
    say(this.trouble, done ? "" : this.desk.trouble);
    if (done) this.dialog.close();
  }
}

function makeItem(item: SurveyItem, at: number): HTMLElement {
  if (item.kind === "words") {
    const label = make("label", "survey-item");
    const field = make("textarea");
    field.name = item.key;
    field.rows = 3;
    field.maxLength = 2000;
    label.append(make("span", "survey-text", `${at + 1}. ${item.text}${item.optional ? " (may be left out)" : ""}`), field);
    label.dataset["key"] = item.key;
    return label;
  }
  const group = make("fieldset", "survey-item");
  group.dataset["key"] = item.key;
  group.append(make("legend", "survey-text", `${at + 1}. ${item.text}${item.optional ? " (may be left out)" : ""}`));
  const values = valuesOf(item);
  const scale = make("div", "survey-scale");
  scale.dataset["fine"] = String(values.length > FEW);
  scale.dataset["named"] = String(item.labels.length === values.length);
  for (const value of values) {
    const label = make("label");
    const radio = make("input");
    radio.type = "radio";
    radio.name = item.key;
    radio.value = String(value);
    const words = labelOf(item, value);
    const end = value === values[0] ? item.low : value === values.at(-1) ? item.high : "";
    radio.setAttribute("aria-label", end === "" || end === words ? words : `${words}, ${end}`);
    label.append(radio, make("span", "", words));
    scale.append(label);
  }
  const ends = make("div", "survey-ends");
  ends.setAttribute("aria-hidden", "true");
  ends.append(make("span", "", item.low), make("span", "", item.high));
  ends.hidden = item.labels.length === values.length || (item.low === "" && item.high === "");
  group.append(scale, ends);
  return group;
}
