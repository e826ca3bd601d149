/** The magnifier: what lies under the pointer, pixel by pixel, beside the pointer. */

import type { Vector2 } from "../generated/messages";
import type { Box, Size } from "./fit";

export const LOUPE_SIZE = 148;
const GAP = 26;
/** A finger hides more than a pointer. */
const FINGER_GAP = 64;

/** Returns the part of the bitmap that a loupe shows with `pixel` in its middle, in the bitmap's own pixels. */
export function loupeSource(pixel: Vector2, across: number, picture: Size, bitmap: Size): Box {
  const x = bitmap.width / picture.width;
  const y = bitmap.height / picture.height;
  return {
    left: (pixel[0] + 0.5 - across / 2) * x,
    top: (pixel[1] + 0.5 - across / 2) * y,
    width: across * x,
    height: across * y,
  };
}

/** Returns how many picture pixels a loupe spans: at least four times larger than on the canvas, whole pixels. */
export function loupeAcross(scale: number): number {
  return Math.max(7, Math.min(37, Math.round(LOUPE_SIZE / (4 * scale) / 2) * 2 + 1));
}

/**
 * Returns where a loupe's upper left corner goes: beside the pointer and on the canvas, above a finger where it can be;
 * where a canvas is too small for that, as far away as it gets.
 */
export function loupeCorner([x, y]: Vector2, canvas: Size, finger: boolean): Vector2 {
  const away = LOUPE_SIZE / 2 + (finger ? FINGER_GAP : GAP);
  let best: Vector2 = [0, 0];
  let farthest = -1;
  for (const [right, down] of finger ? ABOVE_FIRST : ASIDE_FIRST) {
    const corner: Vector2 = [
      within(x + right * away - LOUPE_SIZE / 2, canvas.width), within(y + down * away - LOUPE_SIZE / 2, canvas.height),
    ];
    const apart = Math.hypot(corner[0] + LOUPE_SIZE / 2 - x, corner[1] + LOUPE_SIZE / 2 - y);
    if (apart >= away - 1e-6) return corner;
    if (apart > farthest) {
      farthest = apart;
      best = corner;
    }
  }
  return best;
}

const ASIDE_FIRST: readonly Vector2[] = [[0.8, -0.8], [-0.8, -0.8], [0.8, 0.8], [-0.8, 0.8], [1, 0], [-1, 0]];
const ABOVE_FIRST: readonly Vector2[] = [[0, -1], [-0.8, -0.8], [0.8, -0.8], [-1, 0], [1, 0], [0.8, 0.8]];

function within(start: number, room: number): number {
  return Math.max(0, Math.min(room - LOUPE_SIZE, start));
}

/** Draws a loupe over a canvas whose context is scaled to CSS pixels. */
export function drawLoupe(
  context: CanvasRenderingContext2D, bitmap: ImageBitmap, picture: Size, scale: number,
  pixel: Vector2, corner: Vector2, colour: string,
): void {
  const source = loupeSource(pixel, loupeAcross(scale), picture, bitmap);
  const [x, y] = corner;
  const middle = LOUPE_SIZE / 2;
  context.save();
  context.beginPath();
  context.arc(x + middle, y + middle, middle - 2, 0, 2 * Math.PI);
  context.fillStyle = "#05080c";
  context.fill();
  context.save();
  context.clip();
  context.imageSmoothingEnabled = false;
  context.drawImage(bitmap, source.left, source.top, source.width, source.height, x, y, LOUPE_SIZE, LOUPE_SIZE);
  context.restore();
  context.lineWidth = 3;
  context.strokeStyle = "#0b1017";
  context.stroke();
  context.lineWidth = 1.5;
  context.strokeStyle = colour;
  context.stroke();
  crosshair(context, x + middle, y + middle);
  context.restore();
}

/** Draws a cross with an open middle: the very place stays visible. */
function crosshair(context: CanvasRenderingContext2D, x: number, y: number): void {
  for (const [width, style] of [[3, "rgba(5, 8, 12, 0.7)"], [1, "#ffffff"]] as const) {
    context.lineWidth = width;
    context.strokeStyle = style;
    context.beginPath();
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
      context.moveTo(x + 6 * dx, y + 6 * dy);
      context.lineTo(x + 26 * dx, y + 26 * dy);
    }
    context.stroke();
  }
}
