/** Where a plate stands so that nothing nearer covers it: above the heart. Pure geometry, metres in the room. */

import { Vector3 } from "three";
import type { Box3 } from "three";

/** Farther up than this nobody would look for it. */
const MOST_M = 0.3;
const NEAREST_M = 0.1;
/** Kept free: the ultrasound's sector reaches somewhat beyond the box. */
const FREE_M = 0.015;
const work = { corner: new Vector3(), side: new Vector3() };

export interface Standing {
  readonly head: Vector3;
  /** Level, of length 1. */
  readonly forward: Vector3;
  readonly aheadM: number;
  /** Of its lower edge. */
  readonly lowerM: number;
  readonly halfWidthM: number;
}

/** How far up a plate has to go; 0 where nothing covers it, or where no place that can be seen would do. */
export function raisedM(thing: Box3, { head, forward, aheadM, lowerM, halfWidthM }: Standing): number {
  if (thing.isEmpty() || thing.containsPoint(head)) return 0;
  work.side.set(-forward.z, 0, forward.x);
  let [top, left, right, nearest] = [-Infinity, Infinity, -Infinity, Infinity];
  for (let i = 0; i < 8; i++) {
    const { corner, side } = work;
    corner.set(i & 1 ? thing.max.x : thing.min.x, i & 2 ? thing.max.y : thing.min.y, i & 4 ? thing.max.z : thing.min.z).sub(head);
    const away = corner.dot(forward);
    if (away < NEAREST_M) return 0; // it surrounds the wearer, or is behind: no height would do
    const share = aheadM / away;
    top = Math.max(top, head.y + corner.y * share);
    left = Math.min(left, corner.dot(side) * share);
    right = Math.max(right, corner.dot(side) * share);
    nearest = Math.min(nearest, away);
  }
  if (nearest > aheadM || left > halfWidthM || right < -halfWidthM) return 0;
  const needed = top + FREE_M - lowerM;
  return needed > 0 && needed <= MOST_M ? needed : 0;
}
