/** Where a viewer's head goes in a chamber of the heart: away from its walls, with what matters in sight. Pure geometry, mm. */

import { Vector3 } from "three";

/** What is known of the blood; points are in `box`, mm. */
export interface Blood {
  /** The way to the nearest wall, mm of `box`; negative outside the blood, Infinity where nothing is known. */
  clearanceMm(point: Vector3): number;
  /** Which chamber or vessel a point is in; 0: in none. */
  chamberAt(point: Vector3): number;
}

/** The head is at least this far from every wall. */
export const LEAST_CLEARANCE_MM = 5;
/** What is known between voxels is a little uncertain. */
const MARGIN_MM = 0.8;
const STEP_MM = 3;
const REACH_MM = 45;
/** What matters is best seen from here. */
const GOOD_MM = 20;
const NEAREST_MM = 9;
/** Nearer to a wall than this the way from the head to what matters goes through it. */
const GRAZE_MM = 0.3;
const work = { way: new Vector3(), sample: new Vector3() };

/**
 * Writes where the head goes; returns whether there is such a place. anchor: what is to be seen, which decides on the
 * chamber (in a wall: the nearest one). behind: from the anchor, unit: where it is best seen from.
 */
export function standpoint(out: Vector3, blood: Blood, anchor: Vector3, behind: Vector3): boolean {
  const chamber = blood.chamberAt(anchor) || nearestChamber(blood, anchor);
  if (chamber === 0) return false;
  const place = new Vector3();
  let [best, found] = [-Infinity, false];
  forEachAround(anchor, (x, y, z) => {
    place.set(x, y, z);
    const clearance = blood.clearanceMm(place);
    if (!(clearance >= LEAST_CLEARANCE_MM + MARGIN_MM) || clearance === Infinity || blood.chamberAt(place) !== chamber) return;
    const way = work.way.subVectors(place, anchor);
    const distance = way.length();
    const sees = distance >= NEAREST_MM && inSight(blood, anchor, way);
    const score = (sees ? 4 : 0) - Math.abs(distance - GOOD_MM) / GOOD_MM + 0.6 * (way.dot(behind) / Math.max(distance, 1e-6))
      + 0.4 * Math.min(1, clearance / 12);
    if (score <= best) return;
    best = score;
    found = true;
    out.copy(place);
  });
  return found;
}

/** Returns the chamber of the nearest place where a head may be; 0: none. */
function nearestChamber(blood: Blood, anchor: Vector3): number {
  const place = new Vector3();
  let [nearest, chamber] = [Infinity, 0];
  forEachAround(anchor, (x, y, z) => {
    const distance = place.set(x, y, z).distanceTo(anchor);
    if (distance >= nearest) return;
    const clearance = blood.clearanceMm(place);
    if (!(clearance >= LEAST_CLEARANCE_MM + MARGIN_MM) || clearance === Infinity) return;
    nearest = distance;
    chamber = blood.chamberAt(place);
  });
  return chamber;
}

function forEachAround({ x, y, z }: Vector3, visit: (x: number, y: number, z: number) => void): void {
  for (let i = -REACH_MM; i <= REACH_MM; i += STEP_MM) {
    for (let j = -REACH_MM; j <= REACH_MM; j += STEP_MM) {
      for (let k = -REACH_MM; k <= REACH_MM; k += STEP_MM) visit(x + i, y + j, z + k);
    }
  }
}

/** Whether no wall is between; an anchor that is itself in a wall is seen where that wall begins. */
function inSight(blood: Blood, anchor: Vector3, way: Vector3): boolean {
  const steps = Math.ceil(way.length() / 1.5);
  const first = Math.ceil(3 / 1.5);
  for (let step = first; step < steps; step++) {
    if (blood.clearanceMm(work.sample.copy(anchor).addScaledVector(way, step / steps)) < GRAZE_MM) return false;
  }
  return true;
}
