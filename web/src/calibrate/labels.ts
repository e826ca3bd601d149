/** Where names go beside their markers, so that they cover neither each other nor another marker. */

import type { Vector2 } from "../generated/messages";
import type { Box, Size } from "./fit";

export interface Labelled {
  /** The marker's middle and its ring's radius, canvas pixels. */
  readonly at: Vector2;
  readonly radius: number;
  readonly width: number;
}

const GAP = 4;
/** To cover a marker is worse than to cover a name; to leave the canvas is worst. */
const RING_WEIGHT = 3;
const OUTSIDE_WEIGHT = 10;

/** Returns a box of a height for each label: the best of eight places around its marker, chosen one after the other. */
export function placedLabels(items: readonly Labelled[], height: number, canvas: Size): Box[] {
  const rings = items.map(({ at: [x, y], radius }) => ({ left: x - radius, top: y - radius, width: 2 * radius, height: 2 * radius }));
  const placed: Box[] = [];
  for (const item of items) {
    let best: Box | null = null;
    let least = Infinity;
    for (const box of candidates(item, height)) {
      let cost = OUTSIDE_WEIGHT * (box.width * box.height - overlap(box, { left: 0, top: 0, ...canvas }));
      for (const other of placed) cost += overlap(box, other);
      for (const ring of rings) cost += RING_WEIGHT * overlap(box, ring);
      if (cost < least) {
        least = cost;
        best = box;
      }
    }
    placed.push(best!);
  }
  return placed;
}

/** Returns the places around a marker, the usual one first: right above, right, right below, then left, above, below. */
function candidates({ at: [x, y], radius, width }: Labelled, height: number): Box[] {
  const reach = radius + GAP;
  const right = x + reach;
  const left = x - reach - width;
  const middle = y - height / 2;
  const above = y - reach - height + 3;
  const below = y + reach - 3;
  const places: Vector2[] = [
    [right - 4, above + 6], [right, middle], [right - 4, below - 6], [left + 4, above + 6], [left, middle], [left + 4, below - 6],
    [x - width / 2, above], [x - width / 2, below],
  ];
  return places.map(([start, top]) => ({ left: start, top, width, height }));
}

/** Returns the area that two boxes share. */
function overlap(a: Box, b: Box): number {
  const width = Math.min(a.left + a.width, b.left + b.width) - Math.max(a.left, b.left);
  const height = Math.min(a.top + a.height, b.top + b.height) - Math.max(a.top, b.top);
  return width > 0 && height > 0 ? width * height : 0;
}
