/** What stands on an X-ray picture: the arm's angles, the patient's sides, a scale at the isocentre, and buttons of presets. */

import { CanvasTexture, LinearFilter, SRGBColorSpace, Vector3 } from "three";
import type { ArmAngles } from "../stage/settings";
import type { ArmAxes } from "./arms";
import { ARM_PRESETS, armText, FIELD_MM, MAGNIFICATION, sameArm, sideLetters } from "./arms";
import type { ArmPreset } from "./arms";

const PIXELS = 640;
const SCALE_MM = 20;
const INK = "#f2f5f8";
const EDGE = "rgba(0, 0, 0, 0.75)";
const ACTIVE = "#ffb454";
/** The row of presets: from the sides, from below, high, and between two of them, in the text's units. */
const ROW = { side: 10, below: 52, high: 34, gap: 3 } as const;

export interface OverlayState {
  readonly name: string;
  readonly angles: ArmAngles;
  /** What is amiss, in words; empty: nothing. */
  readonly message: string;
  /** The catheter is a prediction. */
  readonly ghost: boolean;
  /** Times as large as usual: more where the picture is shown small. */
  readonly textScale: number;
  /** Whether presets stand on the picture, as where there are no controls beside it. */
  readonly buttons: boolean;
}

/** Returns the preset whose button is at a place, u from the left and v from below, 0 to 1; null: none. */
export function presetAt(u: number, v: number, textScale: number): ArmPreset | null {
  const side = PIXELS / textScale;
  const above = v * side - ROW.below;
  if (above < 0 || above > ROW.high) return null;
  const at = Math.floor((u * side - ROW.side) / ((side - 2 * ROW.side) / ARM_PRESETS.length));
  return ARM_PRESETS[at] ?? null;
}

/** A square canvas, drawn again only when it is asked to. */
export class FluoroOverlay {
  readonly texture: CanvasTexture;
  private readonly context: CanvasRenderingContext2D;
  private readonly away = new Vector3();

  constructor() {
    const canvas = document.createElement("canvas");
    canvas.width = canvas.height = PIXELS;
    const context = canvas.getContext("2d");
    if (context === null) throw new Error("This browser gives no 2D canvas.");
    this.context = context;
    this.texture = new CanvasTexture(canvas);
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.minFilter = LinearFilter;
    this.texture.generateMipmaps = false;
  }

  draw(state: OverlayState, axes: ArmAxes): void {
    const { context } = this;
    const side = PIXELS / state.textScale;
    context.setTransform(state.textScale, 0, 0, state.textScale, 0, 0);
    context.clearRect(0, 0, side, side);
    context.lineJoin = "round";
    const small = state.textScale > 1.15;
    const below = this.drawAngles(armText(state.angles), side);
    this.write(state.name, side - 24, 30, "right", "600 21px");
    this.write(small ? "simulated" : "simulated, for training only", side - 24, side - 24, "right", "13px");
    this.write(`× ${MAGNIFICATION.toFixed(2)}`, side - 24, 56, "right", "14px");
    this.drawScale(side, small);
    const { right, up } = axes;
    this.write(sideLetters(right), side - 20, side / 2, "right", "600 19px");
    this.write(sideLetters(this.away.copy(right).negate()), 20, side / 2, "left", "600 19px");
    this.write(sideLetters(up), side / 2, 26, "center", "600 19px");
    this.write(sideLetters(this.away.copy(up).negate()), side / 2, side - 24, "center", "600 19px");
    if (state.ghost) this.write("predicted", 24, below, "left", "600 15px", ACTIVE);
    if (state.message !== "") this.write(state.message, side / 2, side * 0.2, "center", "600 16px", ACTIVE);
    if (state.buttons) this.drawButtons(side, state.angles);
    this.texture.needsUpdate = true;
  }

  dispose(): void {
    this.texture.dispose();
  }

  private write(text: string, x: number, y: number, align: CanvasTextAlign, font: string, ink = INK): void {
    const { context } = this;
    context.font = `${font} system-ui, sans-serif`;
    context.textAlign = align;
    context.textBaseline = "middle";
    context.lineWidth = 4;
    context.strokeStyle = EDGE;
    context.strokeText(text, x, y);
    context.fillStyle = ink;
    context.fillText(text, x, y);
  }

  /** Writes the angles in one line, or in two where the picture is small; returns where the next line goes. */
  private drawAngles(text: string, side: number): number {
    const font = "600 21px";
    this.context.font = `${font} system-ui, sans-serif`;
    const lines = 24 + this.context.measureText(text).width < side / 2 - 16 ? [text] : text.split("  ");
    for (const [row, line] of lines.entries()) this.write(line, 24, 30 + 26 * row, "left", font);
    return 30 + 26 * lines.length;
  }

  private drawButtons(side: number, angles: ArmAngles): void {
    const { context } = this;
    const wide = (side - 2 * ROW.side) / ARM_PRESETS.length;
    const top = side - ROW.below - ROW.high;
    context.textAlign = "center";
    context.lineWidth = 1.5;
    for (const [at, { short, angles: preset }] of ARM_PRESETS.entries()) {
      const left = ROW.side + at * wide + ROW.gap / 2;
      const active = sameArm(preset, angles);
      context.fillStyle = active ? "#1f5f86" : "rgba(11, 16, 23, 0.82)";
      context.strokeStyle = active ? "#7fd0ff" : "rgba(242, 245, 248, 0.4)";
      context.beginPath();
      context.roundRect(left, top, wide - ROW.gap, ROW.high, 5);
      context.fill();
      context.stroke();
      context.fillStyle = INK;
      context.font = "600 11.5px system-ui, sans-serif";
      for (const [row, text] of short.entries()) {
        context.fillText(text, left + (wide - ROW.gap) / 2, top + ROW.high / 2 + 13 * (row - (short.length - 1) / 2), wide - 2 * ROW.gap);
      }
    }
  }

  private drawScale(side: number, small: boolean): void {
    const { context } = this;
    const long = (SCALE_MM / FIELD_MM) * side;
    const y = side - 24;
    for (const [width, style] of [[5, EDGE], [2, INK]] as const) {
      context.lineWidth = width;
      context.strokeStyle = style;
      context.beginPath();
      context.moveTo(24, y - 6);
      context.lineTo(24, y);
      context.lineTo(24 + long, y);
      context.lineTo(24 + long, y - 6);
      context.stroke();
    }
    this.write(small ? `${SCALE_MM} mm` : `${SCALE_MM} mm at the isocentre`, 24, y - 17, "left", "14px");
  }
}
