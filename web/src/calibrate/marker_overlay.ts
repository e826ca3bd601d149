/** What is drawn over a picture while markers are placed: a ring for each, its name, its residual, the loupe. */

import type { Vector2 } from "../generated/messages";
import { ringColour } from "./colours";
import type { Canvas } from "./live_picture";
import type { Size } from "./fit";
import { toCanvas } from "./fit";
import { placedLabels } from "./labels";
import { drawLoupe, loupeCorner } from "./loupe";
import type { ShownMarker } from "./marker_model";

/** A ring's radius on a picture of usual size, CSS pixels; it does not grow with the zoom. */
const RADIUS = 11;
const USUAL_WIDTH = 640;
const MOST_GROWTH = 1.7;
/** A residual as long as a ring's radius. */
const RESIDUAL_PX = 0.05;
/** The longest arrow, in radii. */
const MOST_ARROW = 8;
const DARK = "rgba(4, 10, 16, 0.8)";

/** Where a person points: the pointer on the canvas, the place in the picture that is meant, what it is for. */
export interface Pointing {
  readonly at: Vector2;
  readonly pixel: Vector2;
  readonly colour: string;
  readonly finger: boolean;
}

export function drawMarkers(on: Canvas, markers: readonly ShownMarker[], selected: string | null, pointing: Pointing | null): void {
  const there = markers.filter((marker) => marker.pixel !== null);
  const last = there.filter((marker) => marker.key === selected); // nothing covers the one that is being worked on
  const others = there.filter((marker) => marker.key !== selected);
  for (const marker of [...others, ...last]) drawMarker(on, marker, marker.pixel!, marker.key === selected);
  drawLabels(on, [...last, ...others], selected);
  if (pointing === null || on.bitmap === null) return;
  const corner = loupeCorner(pointing.at, on.canvas, pointing.finger);
  drawLoupe(on.context, on.bitmap, on.picture, on.fit.scale, pointing.pixel, corner, ringColour(pointing.colour));
}

/** Returns a ring's radius: larger on large screens, which are looked at from farther away. */
function ringRadius(canvas: Size): number {
  return RADIUS * Math.min(MOST_GROWTH, Math.max(1, canvas.width / USUAL_WIDTH));
}

function drawMarker(on: Canvas, marker: ShownMarker, pixel: Vector2, selected: boolean): void {
  const { context } = on;
  const [x, y] = toCanvas(on.fit, pixel);
  const radius = ringRadius(on.canvas);
  const colour = ringColour(marker.colour);
  context.setLineDash(marker.origin === "ambiguous" ? [4, 3] : []);
  ring(context, x, y, radius, 5, DARK);
  ring(context, x, y, radius, selected ? 3 : 2, colour);
  context.setLineDash([]);
  if (selected) ring(context, x, y, radius + 5, 1.5, "#ffffff");
  cross(context, x, y, selected ? 5 : 3);
  if (marker.residual !== null && !marker.moving) arrow(context, [x, y], marker.residual, radius, colour);
}

function ring(context: CanvasRenderingContext2D, x: number, y: number, radius: number, width: number, style: string): void {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.lineWidth = width;
  context.strokeStyle = style;
  context.stroke();
}

function cross(context: CanvasRenderingContext2D, x: number, y: number, size: number): void {
  for (const [width, style] of [[3, DARK], [1, "#ffffff"]] as const) {
    context.beginPath();
    context.moveTo(x - size, y);
    context.lineTo(x + size, y);
    context.moveTo(x, y - size);
    context.lineTo(x, y + size);
    context.lineWidth = width;
    context.strokeStyle = style;
    context.stroke();
  }
}

/** Returns where a residual's arrow ends, from its marker, canvas pixels: enlarged, but never across the picture. */
export function arrowEnd([du, dv]: Vector2, radius: number): Vector2 {
  const radii = Math.hypot(du, dv) / RESIDUAL_PX;
  const enlarged = (radius / RESIDUAL_PX) * Math.min(1, MOST_ARROW / Math.max(radii, 1e-9));
  return [du * enlarged, dv * enlarged];
}

function arrow(context: CanvasRenderingContext2D, [x, y]: Vector2, residual: Vector2, radius: number, colour: string): void {
  const [dx, dy] = arrowEnd(residual, radius);
  const length = Math.hypot(dx, dy);
  if (length < 2) return;
  const head = Math.min(7, length / 2);
  const angle = Math.atan2(dy, dx);
  const path = new Path2D();
  path.moveTo(x, y);
  path.lineTo(x + dx, y + dy);
  for (const turn of [2.6, -2.6]) {
    path.moveTo(x + dx, y + dy);
    path.lineTo(x + dx + head * Math.cos(angle + turn), y + dy + head * Math.sin(angle + turn));
  }
  context.lineCap = "round";
  context.lineWidth = 4.5;
  context.strokeStyle = DARK;
  context.stroke(path);
  context.lineWidth = 2;
  context.strokeStyle = colour;
  context.stroke(path);
  context.lineCap = "butt";
}

function drawLabels(on: Canvas, markers: readonly ShownMarker[], selected: string | null): void {
  const { context } = on;
  const radius = ringRadius(on.canvas);
  const fontPx = Math.round((12 * radius) / RADIUS);
  context.font = `550 ${fontPx}px system-ui, sans-serif`;
  context.textBaseline = "middle";
  const texts = markers.map((marker) => (marker.residual_px === null ? marker.name : `${marker.name}  ${marker.residual_px.toFixed(2)} px`));
  const boxes = placedLabels(markers.map((marker, index) => ({
    at: toCanvas(on.fit, marker.pixel!), radius, width: context.measureText(texts[index]!).width + 10,
  })), fontPx + 6, on.canvas);
  boxes.forEach(({ left, top, width, height }, index) => {
    context.fillStyle = "rgba(11, 16, 23, 0.86)";
    context.beginPath();
    context.roundRect(left, top, width, height, 5);
    context.fill();
    context.fillStyle = markers[index]!.key === selected ? "#ffffff" : "#dbe4ee";
    context.fillText(texts[index]!, left + 5, top + height / 2 + 0.5);
  });
}
