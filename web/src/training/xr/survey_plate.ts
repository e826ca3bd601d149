/** A survey in a headset: one item after another, its scale as buttons, with a way back. What is asked in words is left to the page. */

import type { Stage } from "../../stage/stage";
import { wrapped } from "../../guide/xr_layout";
import { box, INK, write } from "../../xr/canvas_plate";
import type { Rect } from "../../xr/canvas_plate";
import type { Desk } from "../desk";
import { labelOf, surveyId, SurveyWalk, valuesOf } from "../survey";
import { WORDS_ON_PAGE } from "../words";
import type { Spot } from "./button_plate";
import { BAR_MM, ButtonPlate, EM } from "./button_plate";

const WIDTH = 600;
const HEIGHT = 404;
const MARGIN = 22;
/** More buttons than these go to a second row: they can be read and hit then. */
const A_ROW = 11;
const SCALE_Y = 196;
const BUTTON_H = 46;
const GAP = 6;

export class SurveyPlate extends ButtonPlate {
  private walk: SurveyWalk | null = null;
  private walked = "";
  private dismissed = "";
  private started = false;

  constructor(stage: Stage, private readonly desk: Desk) {
    super(stage, "survey", WIDTH, HEIGHT);
    stage.training.listen(() => this.take());
  }

  /** Whether a survey is to be answered here and now. */
  get wanted(): boolean {
    const { training } = this.stage;
    return this.walk !== null && training.operating && !training.atHand && this.dismissed !== this.walked;
  }

  reopen(): void {
    this.dismissed = "";
    this.refresh();
  }

  /** What it asks, for tests. */
  get text(): string {
    const { walk } = this;
    return walk === null || !this.visible ? "" : `${walk.progress} ${walk.item?.text ?? this.lastWords(walk)}`;
  }

  protected dismiss(): void {
    this.dismissed = this.walked;
  }

  protected heading(): string {
    const { walk } = this;
    if (walk === null) return "Survey";
    return this.started && walk.item !== null ? `${walk.survey.name} · ${walk.progress}` : walk.survey.name;
  }

  protected spots(): readonly Spot[] {
    const { walk } = this;
    if (walk === null) return [];
    const foot = HEIGHT - BUTTON_H - 14;
    const back: Spot = { label: "Back", rect: { x: MARGIN, y: foot, w: 110, h: BUTTON_H }, act: () => this.goBack() };
    const right = (label: string, act: () => void, main: boolean): Spot => (
      { label, rect: { x: WIDTH - MARGIN - 180, y: foot, w: 180, h: BUTTON_H }, act, main });
    if (!this.started) {
      const begin = walk.index === 0 ? "Begin" : "Go on";
      return walk.ratings.length === 0 ? [right("Close", () => this.dismiss(), true)] : [right(begin, () => void (this.started = true), true)];
    }
    const { item } = walk;
    if (item === null) {
      const later: Spot = { label: "Go on on the page", rect: { x: WIDTH - MARGIN - 390, y: foot, w: 200, h: BUTTON_H }, act: () => this.dismiss() };
      const last = right(walk.finishes ? "Hand in" : "Close", () => void this.finish(), true);
      return walk.finishes && walk.words > 0 ? [back, later, last] : [back, last];
    }
    const given = walk.answerOf(item);
    const values = valuesOf(item);
    const rects = scaleRects(values.length);
    const spots = values.map((value, i): Spot => (
      { label: labelOf(item, value), rect: rects[i]!, act: () => this.answer(value), main: given === value }));
    if (walk.index > 0) spots.push(back);
    if (given !== undefined) spots.push(right("Keep", () => this.answer(Number(given)), false));
    else if (item.optional) spots.push(right("Leave out", () => walk.skip(), false));
    return spots;
  }

  protected paintBody(context: CanvasRenderingContext2D): void {
    const { walk } = this;
    if (walk === null) return;
    const full = { x: MARGIN, w: WIDTH - 2 * MARGIN };
    const say = (text: string, y: number, em: number, ink: string, most: number): void => {
      wrapped(context, text, full.w, em).slice(0, most).forEach((line, i) => write(context, line, { ...full, y: y + 28 * i, h: 28 }, em, ink, "left", 500));
    };
    const { item } = walk;
    if (!this.started) {
      say(walk.survey.instruction, BAR_MM + 16, EM.text, INK.text, 5);
      if (walk.words > 0) say(WORDS_ON_PAGE, BAR_MM + 180, EM.small, INK.soft, 2);
      return;
    }
    const done = { x: 0, y: BAR_MM, w: (WIDTH * walk.index) / Math.max(1, walk.ratings.length), h: 4 };
    box(context, done, 0, INK.accent);
    if (item === null) {
      say(this.lastWords(walk), BAR_MM + 24, EM.text, INK.text, 4);
      return;
    }
    say(item.text, BAR_MM + 18, 21, INK.text, 4);
    const values = valuesOf(item);
    const y = SCALE_Y + Math.ceil(values.length / A_ROW) * (BUTTON_H + GAP);
    if (item.labels.length === values.length) return;
    write(context, item.low, { x: MARGIN, y, w: full.w / 2 - 10, h: 26 }, EM.small, INK.soft);
    write(context, item.high, { x: WIDTH / 2 + 10, y, w: full.w / 2 - 10, h: 26 }, EM.small, INK.soft, "right");
  }

  /** Takes over what is asked, and what was answered elsewhere meanwhile. */
  private take(): void {
    const { survey } = this.stage.training;
    this.refresh();
    if (survey === null) {
      this.walk = null;
      this.walked = "";
      return;
    }
    const id = surveyId(survey);
    if (id === this.walked) return; // what comes now is what was given here
    this.walked = id;
    this.walk = new SurveyWalk(survey);
    this.started = false;
  }

  private answer(value: number): void {
    const { walk } = this;
    const item = walk?.item ?? null;
    if (walk === null || item === null) return;
    walk.answer(value);
    void this.desk.answer(walk.survey.survey, walk.survey.occasion, { [item.key]: value }, false);
  }

  private goBack(): void {
    this.walk?.back();
  }

  private async finish(): Promise<void> {
    const { walk } = this;
    if (walk === null) return;
    if (!walk.finishes) {
      this.dismiss();
      return;
    }
    if (await this.desk.answer(walk.survey.survey, walk.survey.occasion, walk.answers, true)) this.dismiss();
    this.refresh();
  }

  private lastWords(walk: SurveyWalk): string {
    if (this.desk.trouble !== "") return this.desk.trouble;
    if (!walk.finishes) return `Thank you. ${WORDS_ON_PAGE}`;
    return walk.words > 0 ? `That was all. ${WORDS_ON_PAGE} They may be left out.` : "That was all. Hand it in, or go back to change something.";
  }
}

/** Where the buttons of a scale are: rows of at most eleven, as wide as the plate has room for. */
function scaleRects(count: number): Rect[] {
  const rows = Math.ceil(count / A_ROW);
  const each = Math.ceil(count / rows);
  const w = Math.min(150, (WIDTH - 2 * MARGIN - GAP * (each - 1)) / each);
  const start = rows > 1 ? MARGIN : (WIDTH - each * w - (each - 1) * GAP) / 2;
  return Array.from({ length: count }, (_, i) => ({
    x: start + (i % each) * (w + GAP), y: SCALE_Y + Math.floor(i / each) * (BUTTON_H + GAP), w, h: BUTTON_H,
  }));
}
