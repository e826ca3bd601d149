/** What is drawn over a slice: outlines, crosshair, seeds, the letters of its sides, a scale. */

import type { Size } from "../calibrate/fit";
import type { HeartSeed, SlicePlane } from "../generated/messages";
import type { Contours } from "./contours";
import type { Placed, PlaneName } from "./geometry";
import { ALONG, AXES, inPlane, toCanvas } from "./geometry";
import type { SeedsModel } from "./model";

export const PLANE_COLOURS: Record<PlaneName, string> = { axial: "#4cc2ff", coronal: "#45d39a", sagittal: "#ffb454" };
const GAP = 13;
const SEED_RADIUS = 6;
const EDGE = 8;
const SCALES_MM = [100, 50, 20, 10, 5, 2, 1];
const SHADOW = "rgb(3 6 10 / 0.85)";

export function drawContours(
  context: CanvasRenderingContext2D, at: Placed, contours: Contours, colours: ReadonlyMap<number, string>, strength: number,
): void {
  context.lineWidth = 1.4;
  context.globalAlpha = strength;
  for (const [label, ends] of contours) {
    const colour = colours.get(label);
    if (colour === undefined) continue;
    context.strokeStyle = colour;
    context.beginPath();
    for (let n = 0; n < ends.length; n += 4) {
      context.moveTo(at.left + (ends[n]! + 0.5) * at.perColumn, at.top + (ends[n + 1]! + 0.5) * at.perRow);
      context.lineTo(at.left + (ends[n + 2]! + 0.5) * at.perColumn, at.top + (ends[n + 3]! + 0.5) * at.perRow);
    }
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** Draws where the other two planes cut this one, open in the middle. */
export function drawCrosshair(context: CanvasRenderingContext2D, at: Placed, name: PlaneName, model: SeedsModel, canvas: Size): void {
  const [x, y] = toCanvas(at, inPlane(name, model.cursor));
  const [right, down] = AXES[name];
  context.globalAlpha = 0.75;
  context.lineWidth = 1;
  for (const [colour, pieces] of [
    [PLANE_COLOURS[ALONG[right]!], [[x, 0, x, y - GAP], [x, y + GAP, x, canvas.height]]],
    [PLANE_COLOURS[ALONG[down]!], [[0, y, x - GAP, y], [x + GAP, y, canvas.width, y]]],
  ] as const) {
    context.strokeStyle = colour;
    context.beginPath();
    for (const [fromX, fromY, toX, toY] of pieces) {
      context.moveTo(Math.round(fromX) + 0.5, Math.round(fromY) + 0.5);
      context.lineTo(Math.round(toX) + 0.5, Math.round(toY) + 0.5);
    }
    context.stroke();
  }
  context.globalAlpha = 1;
}

/** Draws the seeds in and near the slice: a full disc lies in it, a faint ring a few millimetres off. */
export function drawSeeds(context: CanvasRenderingContext2D, at: Placed, name: PlaneName, model: SeedsModel): void {
  for (const { seed, off } of model.seedsNear(name).sort((a, b) => b.off - a.off)) {
    const here = off <= 0.5;
    const chosen = seed.id === model.selected;
    const [x, y] = toCanvas(at, inPlane(name, seed.seen));
    context.beginPath();
    context.arc(x, y, SEED_RADIUS, 0, 2 * Math.PI);
    context.globalAlpha = here ? 1 : 0.6;
    if (here) {
      context.fillStyle = colourOf(seed, model);
      context.fill();
    }
    context.lineWidth = here ? 4 : 3;
    context.strokeStyle = SHADOW;
    context.stroke();
    context.lineWidth = here ? 2 : 1.5;
    context.strokeStyle = here ? "#ffffff" : colourOf(seed, model);
    context.stroke();
    if (chosen) {
      context.beginPath();
      context.arc(x, y, SEED_RADIUS + 5, 0, 2 * Math.PI);
      context.lineWidth = 1.5;
      context.strokeStyle = "#ffffff";
      context.stroke();
    }
    context.globalAlpha = 1;
  }
}

function colourOf(seed: HeartSeed, model: SeedsModel): string {
  return model.structure(seed.structure)?.colour ?? "#ffffff";
}

/** Writes what the four sides are called. */
export function drawLetters(context: CanvasRenderingContext2D, plane: SlicePlane, canvas: Size): void {
  const [left, right, top, bottom] = plane.letters;
  context.font = "600 13px system-ui, sans-serif";
  const { width, height } = canvas;
  write(context, left, EDGE, height / 2, "left", "middle");
  write(context, right, width - EDGE, height / 2, "right", "middle");
  write(context, top, width / 2, EDGE, "center", "top");
  write(context, bottom, width / 2, height - EDGE, "center", "bottom");
}

/** Draws a scale of a round length, at most a quarter of the picture wide. */
export function drawScale(context: CanvasRenderingContext2D, at: Placed, canvas: Size): void {
  const length = SCALES_MM.find((mm) => mm * at.fit.scale <= canvas.width / 4);
  if (length === undefined) return;
  const right = canvas.width - EDGE - 2;
  const left = right - length * at.fit.scale;
  const y = canvas.height - EDGE - 3;
  for (const [colour, wide] of [[SHADOW, 4], ["#dbe4ee", 1.5]] as const) {
    context.strokeStyle = colour;
    context.lineWidth = wide;
    context.beginPath();
    for (const [x0, y0, x1, y1] of [[left, y, right, y], [left, y - 4, left, y + 3], [right, y - 4, right, y + 3]] as const) {
      context.moveTo(x0, y0);
      context.lineTo(x1, y1);
    }
    context.stroke();
  }
  context.font = "11px system-ui, sans-serif";
  write(context, length >= 10 ? `${length / 10} cm` : `${length} mm`, right, y - 6, "right", "bottom");
}

function write(
  context: CanvasRenderingContext2D, text: string, x: number, y: number, align: CanvasTextAlign, baseline: CanvasTextBaseline,
): void {
  context.textAlign = align;
  context.textBaseline = baseline;
  context.lineWidth = 3;
  context.lineJoin = "round";
  context.strokeStyle = SHADOW;
  context.strokeText(text, x, y);
  context.fillStyle = "#dbe4ee";
  context.fillText(text, x, y);
}
