/** A plate that is written and drawn on: a canvas as a texture, sent to the graphics card only when it was redrawn. */

import { CanvasTexture, Group, LinearFilter, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace, Vector4 } from "three";
import type { Plate } from "../flat/plate";

export const FONT = 'system-ui, "Segoe UI", Roboto, sans-serif';
/** After the heart and the catheter: what is to be read is not seen through them. */
export const PLATE_ORDER = 60;

export const INK = {
  panel: "rgba(16, 23, 33, 0.985)", bar: "#1d2a3a", row: "#172230", track: "#33475e", edge: "#48607c",
  text: "#f2f6fa", soft: "#b7c6d6", faint: "#8193a6", accent: "#3f8cff", onAccent: "#ffffff",
  good: "#4ade80", warn: "#fbbf24", bad: "#ff6b6b", idle: "#9fb1c4",
} as const;

const LIT = `
vec2 within = step(lit.xy, vMapUv) * step(vMapUv, lit.zw);
diffuseColor.rgb = mix(diffuseColor.rgb, vec3(1.0), 0.03 * within.x * within.y);`;

export abstract class CanvasPlate implements Plate {
  readonly group = new Group();
  readonly widthM: number;
  readonly heightM: number;
  protected readonly context: CanvasRenderingContext2D;
  private readonly texture: CanvasTexture;
  private readonly material: MeshBasicMaterial;
  /** Left, lower, right and upper edge of what is lit up, 0 to 1. */
  private readonly lit = { value: new Vector4() };

  /** Sizes in mm; `sharpness`: pixels a mm. One unit of the drawing is one mm, from the upper left corner. */
  constructor(readonly title: string, readonly widthMm: number, readonly heightMm: number, sharpness: number, order = PLATE_ORDER) {
    this.widthM = widthMm / 1000;
    this.heightM = heightMm / 1000;
    const canvas = document.createElement("canvas");
    canvas.width = Math.round(widthMm * sharpness);
    canvas.height = Math.round(heightMm * sharpness);
    this.context = canvas.getContext("2d")!;
    this.context.scale(canvas.width / widthMm, canvas.height / heightMm);
    this.texture = new CanvasTexture(canvas);
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.minFilter = LinearFilter;
    this.texture.generateMipmaps = false;
    this.material = new MeshBasicMaterial({ map: this.texture, transparent: true, toneMapped: false });
    this.material.onBeforeCompile = (shader) => {
      shader.uniforms["lit"] = this.lit;
      shader.fragmentShader = shader.fragmentShader
        .replace("#include <common>", "#include <common>\nuniform vec4 lit;")
        .replace("#include <map_fragment>", `#include <map_fragment>\n${LIT}`);
    };
    const mesh = new Mesh(new PlaneGeometry(this.widthM, this.heightM), this.material);
    mesh.renderOrder = order;
    this.group.name = title;
    this.group.add(mesh);
    this.group.visible = false;
  }

  get visible(): boolean {
    return this.group.visible;
  }

  /** Draws everything anew and sends it to the graphics card. */
  protected redraw(): void {
    this.context.clearRect(0, 0, this.widthMm, this.heightMm);
    this.paint(this.context);
    this.texture.needsUpdate = true;
  }

  /** Lights up a part of it without drawing it anew; null: nothing. */
  protected light(at: Rect | null): void {
    if (at === null) this.lit.value.set(0, 0, 0, 0);
    else {
      const { widthMm: w, heightMm: h } = this;
      this.lit.value.set(at.x / w, 1 - (at.y + at.h) / h, (at.x + at.w) / w, 1 - at.y / h);
    }
  }

  /** Lets the plate be seen before everything, however near that is. */
  protected before(): void {
    this.material.depthTest = false;
    this.material.depthWrite = false;
  }

  protected abstract paint(context: CanvasRenderingContext2D): void;
}

/** Fills a rectangle with round corners. */
export function box(context: CanvasRenderingContext2D, at: Rect, radius: number, fill: string): void {
  context.beginPath();
  context.roundRect(at.x, at.y, at.w, at.h, radius);
  context.fillStyle = fill;
  context.fill();
}

/** Writes one line, narrowed where it would not fit. sizeMm: the height of the letters' em. */
export function write(
  context: CanvasRenderingContext2D, text: string, at: Rect, sizeMm: number, colour: string,
  align: CanvasTextAlign = "left", weight = 500,
): void {
  context.font = `${weight} ${sizeMm}px ${FONT}`;
  context.textAlign = align;
  context.textBaseline = "middle";
  context.fillStyle = colour;
  const x = align === "left" ? at.x : align === "right" ? at.x + at.w : at.x + at.w / 2;
  context.fillText(text, x, at.y + at.h / 2 + 0.04 * sizeMm, at.w);
}

/** mm on a plate, from its upper left corner. */
export interface Rect {
  readonly x: number;
  readonly y: number;
  readonly w: number;
  readonly h: number;
}

export function contains(rect: Rect, x: number, y: number): boolean {
  return x >= rect.x && x < rect.x + rect.w && y >= rect.y && y < rect.y + rect.h;
}
