/**
 * How a picture lies on a canvas: letterboxed, and zoomed into by a person.
 *
 * Picture coordinates are the camera's own pixels: the centre of the first one is (0, 0), so the picture spans
 * -0.5 … width - 0.5. Canvas coordinates are CSS pixels from the canvas's upper left corner.
 */

import type { Vector2 } from "../generated/messages";

export interface Size {
  readonly width: number;
  readonly height: number;
}

/** What a person looks at: magnification over the letterboxed picture, and the point in the middle, 0 … 1. */
export interface Zoom {
  readonly factor: number;
  readonly x: number;
  readonly y: number;
}

/** Canvas pixels for each picture pixel, and where the picture's upper left corner is on the canvas. */
export interface Fit {
  readonly scale: number;
  readonly left: number;
  readonly top: number;
}

export interface Box {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

export const WHOLE: Zoom = { factor: 1, x: 0.5, y: 0.5 };
export const MOST_ZOOM = 24;
/** How far an arrow key moves a marker, px; with Shift. */
export const NUDGE_PX = 0.25;
export const COARSE_NUDGE_PX = 2;

/** Returns how a picture lies on a canvas. Zooming enlarges the margins' place too: no margin gets wider by it. */
export function fitted(picture: Size, canvas: Size, zoom: Zoom = WHOLE): Fit {
  const scale = zoom.factor * Math.min(canvas.width / picture.width, canvas.height / picture.height);
  return {
    scale,
    left: canvas.width / 2 - held(zoom.x, zoom.factor) * picture.width * scale,
    top: canvas.height / 2 - held(zoom.y, zoom.factor) * picture.height * scale,
  };
}

/** Returns the view's middle, kept so that no edge of the picture comes farther in than it is without zoom. */
function held(middle: number, factor: number): number {
  const reach = (1 - 1 / factor) / 2;
  return Math.min(0.5 + reach, Math.max(0.5 - reach, middle));
}

export function toCanvas(fit: Fit, [u, v]: Vector2): Vector2 {
  return [fit.left + (u + 0.5) * fit.scale, fit.top + (v + 0.5) * fit.scale];
}

export function toPicture(fit: Fit, [x, y]: Vector2): Vector2 {
  return [(x - fit.left) / fit.scale - 0.5, (y - fit.top) / fit.scale - 0.5];
}

/** Returns whether a picture coordinate lies in the picture. */
export function isInside([u, v]: Vector2, picture: Size): boolean {
  return u >= -0.5 && v >= -0.5 && u <= picture.width - 0.5 && v <= picture.height - 0.5;
}

/** Returns the nearest point of the picture. */
export function clamped([u, v]: Vector2, picture: Size): Vector2 {
  return [Math.min(picture.width - 0.5, Math.max(-0.5, u)), Math.min(picture.height - 0.5, Math.max(-0.5, v))];
}

/** Returns the zoom after magnifying by `factor` with the picture held fast under the canvas point `at`. */
export function zoomed(zoom: Zoom, factor: number, at: Vector2, picture: Size, canvas: Size): Zoom {
  const wanted = Math.min(MOST_ZOOM, Math.max(1, zoom.factor * factor));
  const [u, v] = toPicture(fitted(picture, canvas, zoom), at);
  const scale = fitted(picture, canvas, { ...zoom, factor: wanted }).scale;
  return {
    factor: wanted,
    x: held((u + 0.5) / picture.width + (canvas.width / 2 - at[0]) / (picture.width * scale), wanted),
    y: held((v + 0.5) / picture.height + (canvas.height / 2 - at[1]) / (picture.height * scale), wanted),
  };
}

/** Returns the zoom after dragging the picture by (dx, dy) canvas pixels. */
export function panned(zoom: Zoom, [dx, dy]: Vector2, picture: Size, canvas: Size): Zoom {
  const { scale } = fitted(picture, canvas, zoom);
  return {
    factor: zoom.factor,
    x: held(zoom.x - dx / (picture.width * scale), zoom.factor),
    y: held(zoom.y - dy / (picture.height * scale), zoom.factor),
  };
}

/** Returns the point after an arrow key, kept in the picture; null for any other key. */
export function nudged(pixel: Vector2, key: string, coarse: boolean, picture: Size): Vector2 | null {
  const direction = ARROWS[key];
  if (direction === undefined) return null;
  const step = coarse ? COARSE_NUDGE_PX : NUDGE_PX;
  return clamped([pixel[0] + step * direction[0], pixel[1] + step * direction[1]], picture);
}

const ARROWS: Record<string, Vector2> = {
  ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
};
