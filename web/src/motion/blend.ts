/** The catheter between two Tracks, or a little beyond the newer one. */

import { slerpInto, turnAboutZInto } from "../maths/rotation";
import type { Snapshot } from "./snapshot";

const unrolled = new Float64Array(4);

/**
 * Writes the pose a share of the way from a to b (above 1: beyond b) to `out`: points and tip on straight lines, each at
 * the same share of the length, so that the tip stays the tip and the entry the entry; the direction by slerp with the
 * roll taken out of it, and the roll, unwrapped, put back: a turn of more than half a circle goes the way it went.
 *
 * `out` takes b's numbers of points; status, reason and the like stay as they are. Either pose must not be lost.
 */
export function blendInto(out: Snapshot, a: Snapshot, b: Snapshot, share: number): void {
  out.count = b.count;
  blendPoints(out, a, b, share);
  for (let axis = 0; axis < 3; axis++) out.tip[axis] = a.tip[axis]! + share * (b.tip[axis]! - a.tip[axis]!);
  if (a.roll !== null && b.roll !== null) {
    const turn = b.roll - a.roll;
    turnAboutZInto(unrolled, b.orientation, -turn);
    slerpInto(out.orientation, a.orientation, unrolled, share);
    turnAboutZInto(out.orientation, out.orientation, share * turn);
    out.roll = a.roll + share * turn;
    return;
  }
  out.roll = null; // one of them has the orientation of roll 0: no way leads from one to the other
  if ((a.roll === null) === (b.roll === null)) slerpInto(out.orientation, a.orientation, b.orientation, share);
  else out.orientation.set((a.roll === null ? a : b).orientation);
}

function blendPoints(out: Snapshot, a: Snapshot, b: Snapshot, share: number): void {
  const from = a.points;
  const to = b.points;
  if (a.count === b.count) {
    for (let i = 0; i < 3 * b.count; i++) out.points[i] = from[i]! + share * (to[i]! - from[i]!);
    return;
  }
  const step = (a.count - 1) / (b.count - 1); // another number of points: a's are taken at b's shares of the length
  for (let i = 0; i < b.count; i++) {
    const at = Math.min(i * step, a.count - 1);
    const low = Math.min(Math.floor(at), a.count - 2);
    for (let axis = 0; axis < 3; axis++) {
      const p = from[3 * low + axis]! + (at - low) * (from[3 * low + 3 + axis]! - from[3 * low + axis]!);
      out.points[3 * i + axis] = p + share * (to[3 * i + axis]! - p);
    }
  }
}
