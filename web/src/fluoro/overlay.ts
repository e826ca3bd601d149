/** What stands on an X-ray picture: the arm's angles, the patient's sides, a scale at the isocentre. */

import { CanvasTexture, LinearFilter, SRGBColorSpace, Vector3 } from "three";
import type { ArmAngles } from "../stage/settings";
import type { ArmAxes } from "./arms";
import { armText, FIELD_MM, MAGNIFICATION, sideLetters } from "./arms";

const PIXELS = 640;
const SCALE_MM = 20;
const INK = "#f2f5f8";
const EDGE = "rgba(0, 0, 0, 0.75)";
const ACTIVE = "#ffb454";

export interface OverlayState {
  readonly name: string;
  readonly angles: ArmAngles;
  /** What is amiss, in words; empty: nothing. */
  readonly message: string;
  /** The catheter is a prediction. */
  readonly ghost: boolean;
  /** Times as large as usual: more where the picture is shown small. */
  readonly textScale: number;
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
    const [lao, cranial] = armText(state.angles).split("  ");
    const small = state.textScale > 1.15;
    this.write(lao!, 24, 30, "left", "600 21px");
    this.write(cranial!, 24, 56, "left", "600 21px");
    this.write(state.name, side - 24, 30, "right", "600 21px");
    this.write(small ? "simulated" : "simulated, for training only", side - 24, side - 24, "right", "13px");
    this.write(`× ${MAGNIFICATION.toFixed(2)}`, side - 24, 56, "right", "14px");
    this.drawScale(side, small);
    const { right, up } = axes;
    this.write(sideLetters(right), side - 20, side / 2, "right", "600 19px");
    this.write(sideLetters(this.away.copy(right).negate()), 20, side / 2, "left", "600 19px");
    this.write(sideLetters(up), side / 2, 26, "center", "600 19px");
    this.write(sideLetters(this.away.copy(up).negate()), side / 2, side - 24, "center", "600 19px");
    if (state.ghost) this.write("predicted", 24, 82, "left", "600 15px", ACTIVE);
    if (state.message !== "") this.write(state.message, side / 2, side * 0.12, "center", "600 16px", ACTIVE);
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
