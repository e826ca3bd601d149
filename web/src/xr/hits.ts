/** Where a ray or a fingertip meets a flat plate. Pure geometry. */

import { Matrix4, Vector3 } from "three";
import type { Plate } from "../flat/plate";

/** A fingertip this near before a plate points at it, and presses it when it goes through. */
const TOUCH_NEAR_M = 0.05;
const TOUCH_BEHIND_M = 0.04;

export interface Hit {
  plate: Plate | null;
  /** 0 to 1, left to right and bottom to top. */
  u: number;
  v: number;
  /** From the ray's origin, or of the fingertip before (behind: negative) the plate; m in the room. */
  distance: number;
  touching: boolean;
  readonly point: Vector3;
}

export function makeHit(): Hit {
  return { plate: null, u: 0, v: 0, distance: Infinity, touching: false, point: new Vector3() };
}

const work = { inverse: new Matrix4(), origin: new Vector3(), direction: new Vector3() };

/** Writes the nearest visible plate that a ray meets from the front; null as the plate when there is none. */
export function castRay(out: Hit, plates: readonly Plate[], origin: Vector3, direction: Vector3): Hit {
  out.plate = null;
  out.touching = false;
  out.distance = Infinity;
  for (const plate of plates) {
    if (!isShown(plate)) continue;
    enter(plate, origin);
    work.direction.copy(direction).transformDirection(work.inverse);
    if (work.origin.z <= 0 || work.direction.z >= -1e-6) continue;
    const reach = -work.origin.z / work.direction.z;
    const x = work.origin.x + reach * work.direction.x;
    const y = work.origin.y + reach * work.direction.y;
    if (!within(plate, x, y)) continue;
    work.origin.set(x, y, 0).applyMatrix4(plate.group.matrixWorld);
    const distance = work.origin.distanceTo(origin);
    if (distance < out.distance) fill(out, plate, x, y, distance);
  }
  return out;
}

/** Writes the plate that a fingertip is at, if it is at one. `held`: the plate that it is pressing already. */
export function castFinger(out: Hit, plates: readonly Plate[], tip: Vector3, held: Plate | null): Hit {
  out.plate = null;
  out.touching = true;
  out.distance = Infinity;
  for (const plate of plates) {
    if (!isShown(plate) || (held !== null && held !== plate)) continue;
    enter(plate, tip);
    const size = plate.group.matrixWorld.getMaxScaleOnAxis();
    const height = work.origin.z * size;
    if (height > TOUCH_NEAR_M || height < -TOUCH_BEHIND_M || !within(plate, work.origin.x, work.origin.y)) continue;
    if (Math.abs(height) >= Math.abs(out.distance)) continue;
    const { x, y } = work.origin;
    work.origin.set(x, y, 0).applyMatrix4(plate.group.matrixWorld);
    fill(out, plate, x, y, height);
  }
  return out;
}

function enter(plate: Plate, point: Vector3): void {
  work.inverse.copy(plate.group.matrixWorld).invert();
  work.origin.copy(point).applyMatrix4(work.inverse);
}

function within(plate: Plate, x: number, y: number): boolean {
  return Math.abs(x) <= plate.widthM / 2 && Math.abs(y) <= plate.heightM / 2;
}

function fill(out: Hit, plate: Plate, x: number, y: number, distance: number): void {
  out.plate = plate;
  out.u = x / plate.widthM + 0.5;
  out.v = y / plate.heightM + 0.5;
  out.distance = distance;
  out.point.copy(work.origin);
}

/** Whether a plate stands in the scene and nothing above it hides it. */
export function isShown(plate: Plate): boolean {
  let node = plate.group as Plate["group"] | null;
  let root = false;
  for (; node !== null; node = node.parent as Plate["group"] | null) {
    if (!node.visible) return false;
    root = (node as { isScene?: boolean }).isScene === true;
  }
  return root;
}
