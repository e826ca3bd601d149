/** Slices as pixels: Hounsfield units through a window, labels in their colours. */

import type { Vector2 } from "../generated/messages";

/** Which Hounsfield units are shown: all below centre - width / 2 are black. */
export interface Window {
  readonly centre: number;
  readonly width: number;
}

export interface Preset {
  readonly key: string;
  readonly name: string;
  readonly window: Window;
}

export const PRESETS: readonly Preset[] = [
  { key: "cta", name: "Cardiac CTA", window: { centre: 250, width: 800 } },
  { key: "mediastinum", name: "Mediastinum", window: { centre: 40, width: 400 } },
  { key: "bone", name: "Bone", window: { centre: 500, width: 2000 } },
  { key: "lung", name: "Lung", window: { centre: -600, width: 1500 } },
];

const LOWEST_HU = -2048;
const HU_VALUES = 8192;
const LEAST_WIDTH = 10;
const MOST_WIDTH = 4000;

/** Returns the window after dragging by (dx, dy) pixels: to the right is wider, down is darker (a higher centre). */
export function dragged(window: Window, [dx, dy]: Vector2): Window {
  const pace = Math.max(0.5, window.width / 400);
  return {
    centre: Math.round(Math.min(3000, Math.max(-1500, window.centre + dy * pace))),
    width: Math.round(Math.min(MOST_WIDTH, Math.max(LEAST_WIDTH, window.width + dx * pace))),
  };
}

/** Returns the pixel, as a little-endian RGBA word, of every Hounsfield unit from -2048 on. */
export function windowTable({ centre, width }: Window): Uint32Array {
  const table = new Uint32Array(HU_VALUES);
  for (let at = 0; at < HU_VALUES; at += 1) {
    const share = (at + LOWEST_HU - (centre - width / 2)) / width;
    const grey = Math.round(255 * Math.min(1, Math.max(0, share)));
    table[at] = (0xff000000 | (grey << 16) | (grey << 8) | grey) >>> 0;
  }
  return table;
}

/** Writes a slice's pixels. */
export function paintCt(hu: Int16Array, table: Uint32Array, pixels: Uint32Array): void {
  for (let at = 0; at < hu.length; at += 1) {
    const value = hu[at]! - LOWEST_HU;
    pixels[at] = table[value < 0 ? 0 : value >= HU_VALUES ? HU_VALUES - 1 : value]!;
  }
}

/** Returns the pixel of every label: opaque where the label is shown, else nothing. */
export function labelTable(colours: ReadonlyMap<number, string>): Uint32Array {
  const table = new Uint32Array(256);
  for (const [label, colour] of colours) {
    const rgb = Number.parseInt(colour.slice(1), 16);
    table[label] = (0xff000000 | ((rgb & 0xff) << 16) | (rgb & 0xff00) | (rgb >> 16)) >>> 0;
  }
  return table;
}

export function paintLabels(labels: Uint8Array, table: Uint32Array, pixels: Uint32Array): void {
  for (let at = 0; at < labels.length; at += 1) pixels[at] = table[labels[at]!]!;
}
