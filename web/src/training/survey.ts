/** Answering a survey, item by item or all at once. No drawing. */

import type { SurveyDescription, SurveyItem } from "../generated/messages";

export type Answers = Readonly<Record<string, number | string>>;

/** The values that a rating may have, from low to high. */
export function valuesOf(item: SurveyItem): number[] {
  const { minimum, maximum } = item;
  const step = item.step > 0 ? item.step : 1;
  const count = Math.min(101, Math.floor((maximum - minimum) / step + 1e-9) + 1);
  return Array.from({ length: count }, (_, i) => Number((minimum + i * step).toFixed(6)));
}

/** What stands on a value's button: its label where it has one of its own, else the number. */
export function labelOf(item: SurveyItem, value: number): string {
  const at = valuesOf(item).indexOf(value);
  return item.labels.length === valuesOf(item).length ? item.labels[at] ?? String(value) : String(value);
}

/** Which survey it is: with another one answering begins anew. */
export function surveyId(survey: SurveyDescription): string {
  return `${survey.participant} ${survey.survey} ${survey.occasion}`;
}

/** Goes through a survey's ratings one by one; items to be answered in words are left to the page. */
export class SurveyWalk {
  private readonly given: Record<string, number | string> = {};
  readonly ratings: readonly SurveyItem[];
  /** How many items are in words. */
  readonly words: number;
  /** 0 to ratings.length; there all ratings are given. */
  index = 0;

  constructor(readonly survey: SurveyDescription) {
    this.ratings = survey.items.filter(({ kind }) => kind === "rating");
    this.words = survey.items.length - this.ratings.length;
    for (const { key } of this.ratings) {
      const given = survey.answers[key];
      if (given !== undefined) this.given[key] = given;
    }
    const open = this.ratings.findIndex(({ key }) => this.given[key] === undefined);
    this.index = open < 0 ? this.ratings.length : open;
  }

  /** The item that is asked now; null when all are through. */
  get item(): SurveyItem | null {
    return this.ratings[this.index] ?? null;
  }

  get answers(): Answers {
    return this.given;
  }

  answerOf(item: SurveyItem): number | string | undefined {
    return this.given[item.key];
  }

  /** "3 of 10". */
  get progress(): string {
    return `${Math.min(this.index + 1, this.ratings.length)} of ${this.ratings.length}`;
  }

  /** Whether the survey can be handed in from here: nothing that must be answered in words is left. */
  get finishes(): boolean {
    return this.survey.items.every(({ key, kind, optional }) => kind === "rating" || optional || this.survey.answers[key] !== undefined);
  }

  /** Answers the item that is asked, and goes on. */
  answer(value: number): void {
    const { item } = this;
    if (item === null) return;
    this.given[item.key] = value;
    this.index += 1;
  }

  /** Leaves an item out, where that is allowed. */
  skip(): void {
    if (this.item?.optional === true) this.index += 1;
  }

  back(): void {
    this.index = Math.max(0, this.index - 1);
  }
}

/** Returns the keys of the items that must be answered and are not. */
export function missing(survey: SurveyDescription, answers: Answers): string[] {
  return survey.items.filter(({ key, optional }) => {
    const given = answers[key];
    return !optional && (given === undefined || given === "");
  }).map(({ key }) => key);
}
