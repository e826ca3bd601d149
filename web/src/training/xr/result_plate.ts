/** How a trial went, in a headset: time, targets, own best and the chief metrics; once more, or shown again. */

import type { CardLineMessage } from "../../generated/messages";
import type { Stage } from "../../stage/stage";
import { wrapped } from "../../guide/xr_layout";
import { box, INK, write } from "../../xr/canvas_plate";
import type { Desk } from "../desk";
import { BETTER, chiefLines, outcomeWords, standingWords, tookWords, trend, valueWords } from "../words";
import type { Spot } from "./button_plate";
import { BAR_MM, ButtonPlate, EM } from "./button_plate";

const WIDTH = 540;
const HEIGHT = 416;
const MARGIN = 20;
const LINES = 4;
const LINE = 52;
const FIRST = 150;
/** Two lines of this fit beside a value. */
const STANDING_EM = 15.6;

export class ResultPlate extends ButtonPlate {
  /** The result that was closed here: it does not come back by itself. */
  private dismissed = "";

  constructor(stage: Stage, private readonly desk: Desk, private readonly onShow: () => void) {
    super(stage, "result", WIDTH, HEIGHT);
    stage.training.listen(() => this.refresh());
  }

  /** Whether there is a result to be read. */
  get wanted(): boolean {
    const { training, replay } = this.stage;
    return training.result !== null && this.dismissed !== this.id && !replay.shown;
  }

  /** Lets the result be read again. */
  reopen(): void {
    this.dismissed = "";
  }

  protected dismiss(): void {
    this.dismissed = this.id;
  }

  protected heading(): string {
    const { run } = this.stage.training;
    return run === null ? "Result" : `${run.participant} · ${run.name}`;
  }

  protected spots(): readonly Spot[] {
    const { training } = this.stage;
    const { result } = training;
    if (result === null) return [];
    const y = HEIGHT - 58;
    const spots: Spot[] = [];
    const add = (label: string, x: number, w: number, act: () => void, main = false, disabled = false): void => {
      spots.push({ label, rect: { x, y, w, h: 46 }, act, main, disabled });
    };
    if (result.run !== null) add("Show the run", MARGIN, 170, this.onShow);
    if (training.operating) {
      add("Repeat", 204, 140, () => void this.desk.repeat(), false, !training.can("training_repeat"));
      add("Done", WIDTH - MARGIN - 150, 150, () => void this.finish(), true);
    } else {
      add("Close", WIDTH - MARGIN - 150, 150, () => this.dismiss(), true);
    }
    return spots;
  }

  protected paintBody(context: CanvasRenderingContext2D): void {
    const { result } = this.stage.training;
    if (result === null) return;
    const full = { x: MARGIN, w: WIDTH - 2 * MARGIN };
    const good = result.outcome === "completed" && result.invalid === "";
    write(context, `${outcomeWords(result)} in ${tookWords(result.active_s)}`, { ...full, y: BAR_MM + 6, h: 40 }, EM.title, good ? INK.good : INK.warn, "left", 650);
    const words = result.invalid === "" ? result.sentence : `It does not count: ${result.invalid}`;
    wrapped(context, words, full.w, EM.small).slice(0, 2).forEach((line, at) => {
      write(context, line, { ...full, y: BAR_MM + 48 + 24 * at, h: 24 }, EM.small, result.invalid === "" ? INK.soft : INK.warn);
    });
    const lines = chiefLines(result.lines, LINES);
    if (lines.length === 0) write(context, "The figures are being worked out …", { ...full, y: FIRST, h: LINE }, EM.small, INK.faint);
    lines.forEach((line, at) => paintLine(context, line, FIRST + at * LINE));
  }

  private get id(): string {
    return this.stage.training.run?.id ?? "";
  }

  private async finish(): Promise<void> {
    this.dismiss();
    await this.desk.close();
  }
}

function paintLine(context: CanvasRenderingContext2D, line: CardLineMessage, y: number): void {
  box(context, { x: MARGIN - 6, y: y + 2, w: WIDTH - 2 * MARGIN + 12, h: LINE - 6 }, 9, INK.row);
  const { arrow } = BETTER[line.better];
  write(context, `${line.name} ${arrow}`, { x: MARGIN + 4, y, w: 200, h: LINE - 2 }, EM.text, INK.text, "left", 550);
  const change = trend(line);
  const ink = line.is_best && line.best_before !== null ? INK.good : change === "better" ? INK.good : change === "worse" ? INK.warn : INK.text;
  write(context, valueWords(line.value, line.unit), { x: 226, y, w: 112, h: LINE - 2 }, EM.text, ink, "right", 650);
  const words = standingWords(line).split(" · ");
  const high = words.length > 1 ? 22 : LINE - 2;
  words.forEach((each, at) => write(context, each, { x: 352, y: y + (words.length > 1 ? 3 : 0) + at * high, w: WIDTH - MARGIN - 356, h: high }, STANDING_EM, INK.soft));
}
