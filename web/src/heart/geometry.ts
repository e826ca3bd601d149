/**
 * Where things are in the three planes.
 *
 * Seen coordinates are voxels (x, y, z): x to the patient's left, y to the back, z to the feet, along the scan's own
 * axes; the centre of the first voxel is (0, 0, 0). A plane's own coordinates are (column, row).
 */

import type { Fit, Size, Zoom } from "../calibrate/fit";
import { fitted, MOST_ZOOM } from "../calibrate/fit";
import type { HeartSeedsState, SlicePlane, Vector2, Vector3 } from "../generated/messages";

export type PlaneName = SlicePlane["name"];
export const PLANES: readonly PlaneName[] = ["axial", "coronal", "sagittal"];

/** Which of x, y, z runs to the right, down, and from slice to slice. */
export const AXES: Record<PlaneName, readonly [0 | 1 | 2, 0 | 1 | 2, 0 | 1 | 2]> = {
  axial: [0, 1, 2], coronal: [0, 2, 1], sagittal: [1, 2, 0],
};
/** The plane whose slices follow each other along x, y, z. */
export const ALONG: readonly PlaneName[] = ["sagittal", "coronal", "axial"];

/** Returns a slice's size in mm: what is fitted into the canvas, so that its shape is true. */
export function sizeMm(plane: SlicePlane): Size {
  return { width: plane.columns * plane.spacing_mm[0], height: plane.rows * plane.spacing_mm[1] };
}

/** How a slice's columns and rows lie on a canvas, CSS pixels: x = left + (column + 0.5) · perColumn. */
export interface Placed {
  readonly left: number;
  readonly top: number;
  readonly perColumn: number;
  readonly perRow: number;
  readonly fit: Fit;
}

export function placed(plane: SlicePlane, canvas: Size, zoom: Zoom): Placed {
  const fit = fitted(sizeMm(plane), canvas, zoom);
  const [right, down] = plane.spacing_mm;
  return { left: fit.left, top: fit.top, perColumn: fit.scale * right, perRow: fit.scale * down, fit };
}

export function toCanvas(at: Placed, [column, row]: Vector2): Vector2 {
  return [at.left + (column + 0.5) * at.perColumn, at.top + (row + 0.5) * at.perRow];
}

export function toSlice(at: Placed, [x, y]: Vector2): Vector2 {
  return [(x - at.left) / at.perColumn - 0.5, (y - at.top) / at.perRow - 0.5];
}

export function isInside([column, row]: Vector2, plane: SlicePlane): boolean {
  return column >= -0.5 && row >= -0.5 && column < plane.columns - 0.5 && row < plane.rows - 0.5;
}

/** Returns the (column, row) of seen coordinates in a plane. */
export function inPlane(plane: PlaneName, seen: Vector3): Vector2 {
  const [right, down] = AXES[plane];
  return [seen[right], seen[down]];
}

/** Returns seen coordinates with (column, row) of a plane put in; the slice stays. */
export function withPlane(plane: PlaneName, seen: Vector3, [column, row]: Vector2): Vector3 {
  const [right, down] = AXES[plane];
  const moved: [number, number, number] = [...seen];
  moved[right] = column;
  moved[down] = row;
  return moved;
}

/** Returns the voxels along x, y, z. */
export function shapeOf(planes: readonly SlicePlane[]): Vector3 {
  const axial = planes.find((plane) => plane.name === "axial")!;
  return [axial.columns, axial.rows, axial.slices];
}

/** Returns the slice in which a place lies; places outside count as at the edge. */
export function sliceAt(plane: PlaneName, seen: Vector3, shape: Vector3): number {
  const axis = AXES[plane][2];
  return Math.min(shape[axis] - 1, Math.max(0, Math.floor(seen[axis] + 0.5)));
}

/** Returns seen coordinates kept inside the voxels' centres. */
export function kept(seen: Vector3, shape: Vector3): Vector3 {
  return [0, 1, 2].map((axis) => Math.min(shape[axis]! - 1, Math.max(0, seen[axis]!))) as unknown as Vector3;
}

/** How much of a view a box takes that is shown as large as it goes. */
const BOX_SHARE = 0.86;

/** Returns the zoom at which a box, from one seen voxel to another, fills a view. */
export function zoomOn(plane: SlicePlane, canvas: Size, low: Vector3, high: Vector3): Zoom {
  const { width, height } = sizeMm(plane);
  const [first, last] = [inPlane(plane.name, low), inPlane(plane.name, high)];
  const [boxWidth, boxHeight] = [0, 1].map((at) => (last[at]! - first[at]! + 1) * plane.spacing_mm[at]!) as [number, number];
  const whole = Math.min(canvas.width / width, canvas.height / height);
  const wanted = BOX_SHARE * Math.min(canvas.width / boxWidth, canvas.height / boxHeight);
  return {
    factor: Math.min(MOST_ZOOM, Math.max(1, wanted / whole)),
    x: ((first[0] + last[0] + 1) / 2) / plane.columns,
    y: ((first[1] + last[1] + 1) / 2) / plane.rows,
  };
}

/** Returns millimetres in ct of seen coordinates. */
export function toCt(columns: HeartSeedsState["ct_from_seen"], seen: Vector3): Vector3 {
  return [0, 1, 2].map((row) =>
    columns[0]![row]! * seen[0] + columns[1]![row]! * seen[1] + columns[2]![row]! * seen[2] + columns[3]![row]!,
  ) as unknown as Vector3;
}

const SIDES = ["RL", "AP", "FH"] as const;

/** Returns a place in ct in words, as "L 12.3  P 45.0  F 101.2 mm". */
export function placeText(ct: Vector3): string {
  return `${ct.map((value, axis) => `${SIDES[axis]![value < 0 ? 0 : 1]!} ${Math.abs(value).toFixed(1)}`).join("  ")} mm`;
}
