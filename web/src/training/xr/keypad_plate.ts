/** The small keypad that a participant's code is typed with in a headset. */

import type { Stage } from "../../stage/stage";
import { wrapped } from "../../guide/xr_layout";
import { box, INK, write } from "../../xr/canvas_plate";
import type { Choice } from "../choice";
import { CODE_KEYS, codeTrouble } from "../code";
import type { Spot } from "./button_plate";
import { BAR_MM, ButtonPlate, EM } from "./button_plate";

const WIDTH = 540;
const HEIGHT = 392;
const MARGIN = 16;
const COLUMNS = 10;
const KEY = { w: 47, h: 44, gap: 4 };
const KEYS_Y = 172;
const LONGEST = 12;

export class KeypadPlate extends ButtonPlate {
  private open = false;
  private typed = "";

  constructor(stage: Stage, private readonly choice: Choice) {
    super(stage, "keypad", WIDTH, HEIGHT, 0.12, 0.62);
  }

  get wanted(): boolean {
    return this.open && this.stage.training.operating;
  }

  /** Opens with the code that is chosen now. */
  ask(): void {
    this.open = true;
    this.typed = this.choice.participant;
    this.refresh();
  }

  protected dismiss(): void {
    this.open = false;
  }

  protected heading(): string {
    return "Participant's code";
  }

  protected spots(): readonly Spot[] {
    const keys = [...CODE_KEYS].map((label, i): Spot => ({
      label, rect: keyRect(i), act: () => this.type(label), disabled: this.typed.length >= LONGEST,
    }));
    const last = KEYS_Y + 3 * (KEY.h + KEY.gap);
    keys.push(
      { label: "⌫", rect: { x: MARGIN + 7 * (KEY.w + KEY.gap), y: last, w: KEY.w, h: KEY.h }, act: () => (this.typed = this.typed.slice(0, -1)) },
      {
        label: "OK", rect: { x: MARGIN + 8 * (KEY.w + KEY.gap), y: last, w: 2 * KEY.w + KEY.gap, h: KEY.h }, act: () => this.take(), main: true,
        disabled: codeTrouble(this.typed) !== "",
      },
    );
    return keys;
  }

  protected paintBody(context: CanvasRenderingContext2D): void {
    const field = { x: MARGIN, y: BAR_MM + 12, w: WIDTH - 2 * MARGIN, h: 50 };
    box(context, field, 9, INK.row);
    write(context, this.typed === "" ? "P01" : this.typed, { ...field, x: field.x + 16, w: field.w - 32 }, 30, this.typed === "" ? INK.faint : INK.text, "left", 650);
    const trouble = this.typed === "" ? "Letters and digits, for example P01." : codeTrouble(this.typed);
    wrapped(context, trouble === "" ? "A good code." : trouble, field.w, EM.small).slice(0, 2).forEach((line, i) => {
      write(context, line, { ...field, y: BAR_MM + 68 + 24 * i, h: 24 }, EM.small, trouble === "" ? INK.good : INK.soft);
    });
  }

  private type(key: string): void {
    if (this.typed.length < LONGEST) this.typed += key;
  }

  private take(): void {
    this.choice.participant = this.typed;
    this.open = false;
  }
}

function keyRect(i: number): Spot["rect"] {
  return { x: MARGIN + (i % COLUMNS) * (KEY.w + KEY.gap), y: KEYS_Y + Math.floor(i / COLUMNS) * (KEY.h + KEY.gap), w: KEY.w, h: KEY.h };
}
