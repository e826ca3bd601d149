/** Which points of a catheter are in the wall, and how deep. */

import type { DistanceField } from "./distance_field";
import { distanceAt, UNKNOWN } from "./distance_field";

/** A mouth through which a catheter comes in or goes out, mm in `ct`. */
export interface Mouth {
  readonly at: readonly [number, number, number];
  /** Unit, out of the blood. */
  readonly out: readonly [number, number, number];
  readonly radiusMm: number;
}

/** So far out of a mouth, and so far beside its rim, a catheter still is in the vessel that was cut off there. */
const BEYOND_MM = 60;
const BESIDE_MM = 3;
/** How far before and behind a mouth's plane is looked, to tell an open end from a valve. */
const LOOK_MM = 3;

export interface WallContact {
  /** Of each point, how deep it is in the wall, mm; 0 where it is not. */
  readonly depths: Float32Array;
  count: number;
  deepestMm: number;
}

/** Returns those mouths that are open ends: there is no blood beyond them. The others are valves and vessels' beginnings. */
export function openEnds(field: DistanceField, mouths: readonly Mouth[]): Mouth[] {
  return mouths.filter(({ at, out }) => {
    const beyond = distanceAt(field, at[0] + LOOK_MM * out[0], at[1] + LOOK_MM * out[1], at[2] + LOOK_MM * out[2]);
    return beyond === UNKNOWN || beyond < 0;
  });
}

/**
 * Writes what of a catheter is in the wall. points: `count` times x y z, mm, `box`, tip first; ctFromBox: 16 numbers column
 * by column; scale: mm of `ct` for one of `box`; radiusMm: the catheter's, in `box`.
 *
 * What lies outside the heart's extent does not count, nor what has not come into the blood yet on the way from the entry,
 * nor what lies in the continuation of an open end. Allocates nothing.
 */
export function wallContact(
  out: WallContact, field: DistanceField, ends: readonly Mouth[], points: Float64Array, count: number,
  ctFromBox: ArrayLike<number>, scale: number, radiusMm: number,
): void {
  out.count = 0;
  out.deepestMm = 0;
  let entered = false;
  for (let i = count - 1; i >= 0; i--) {
    const m = ctFromBox;
    const px = points[3 * i]!, py = points[3 * i + 1]!, pz = points[3 * i + 2]!;
    const x = m[0]! * px + m[4]! * py + m[8]! * pz + m[12]!;
    const y = m[1]! * px + m[5]! * py + m[9]! * pz + m[13]!;
    const z = m[2]! * px + m[6]! * py + m[10]! * pz + m[14]!;
    const distance = distanceAt(field, x, y, z);
    if (distance > 0 && distance !== UNKNOWN) entered = true;
    let depth = 0;
    if (entered) depth = Math.max(0, radiusMm - distance / scale);
    if (depth > 0 && inContinuation(ends, x, y, z)) depth = 0;
    out.depths[i] = depth;
    if (depth > 0) out.count += 1;
    out.deepestMm = Math.max(out.deepestMm, depth);
  }
}

function inContinuation(ends: readonly Mouth[], x: number, y: number, z: number): boolean {
  for (let e = 0; e < ends.length; e++) {
    const { at, out, radiusMm } = ends[e]!;
    const dx = x - at[0], dy = y - at[1], dz = z - at[2];
    const along = dx * out[0] + dy * out[1] + dz * out[2];
    if (along < -BESIDE_MM || along > BEYOND_MM) continue;
    const across = Math.sqrt(Math.max(0, dx * dx + dy * dy + dz * dz - along * along));
    if (across <= radiusMm + BESIDE_MM) return true;
  }
  return false;
}
