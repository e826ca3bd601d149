/** Where the world is put: on a table before the viewer, at true size, or around the viewer's head. Pure geometry, metres. */

import { Matrix4, Quaternion, Vector3 } from "three";
import type { Similarity } from "./similarity";

export type Placement = "table" | "true" | "inside";
export const PLACEMENTS: readonly { readonly name: Placement; readonly label: string }[] = [
  { name: "table", label: "On the table" },
  { name: "true", label: "True scale" },
  { name: "inside", label: "Inside" },
];

export const BELOW_EYES_M = 0.35;
export const AHEAD_M = 0.55;
/** A chamber of 45 mm is a room of a metre. */
export const INSIDE_SCALE = 24;
/** What is looked at inside lies this far below the horizon: where eyes rest. */
const LOOK_DOWN_RAD = (12 * Math.PI) / 180;
/** Farther than this a heart at true scale would not be found. */
const REACH_M = 1.2;
const UP = new Vector3(0, 1, 0);
const FORWARD = new Vector3(0, 0, -1);

const work = {
  forward: new Vector3(), up: new Vector3(), side: new Vector3(), target: new Vector3(),
  matrix: new Matrix4(), from: new Quaternion(), to: new Quaternion(),
};

/** Where somebody's head is in the room. */
export interface Head {
  readonly position: Vector3;
  readonly orientation: Quaternion;
}

/** Writes the level direction in which a head looks; where it looks straight up or down, the way its crown or chin points. */
export function levelForward(head: Head, out: Vector3): Vector3 {
  out.copy(FORWARD).applyQuaternion(head.orientation);
  const steep = out.y;
  if (Math.abs(steep) > 0.97) out.copy(UP).applyQuaternion(head.orientation).multiplyScalar(-Math.sign(steep));
  out.y = 0;
  return out.lengthSq() < 1e-12 ? out.copy(FORWARD) : out.normalize();
}

/** Puts the heart's centre (in the world's own frame) before the viewer below the eyes, upright, at true scale. */
export function onTable(out: Similarity, head: Head, centre: Vector3): Similarity {
  const forward = levelForward(head, work.forward);
  out.orientation.setFromUnitVectors(FORWARD, forward); // both are level, so that this is a turn about the vertical
  out.scale = 1;
  work.target.copy(head.position).addScaledVector(forward, AHEAD_M);
  work.target.y -= BELOW_EYES_M;
  return out.pin(centre, work.target);
}

/** Gives the world its true size about the heart's centre, where that stays within reach; else puts it on the table. */
export function trueScale(out: Similarity, present: Similarity, head: Head, centre: Vector3): Similarity {
  present.apply(work.target.copy(centre));
  const distance = work.target.distanceTo(head.position);
  if (distance > REACH_M || distance < 0.15) return onTable(out, head, centre);
  out.orientation.copy(present.orientation);
  out.scale = 1;
  return out.pin(centre, work.target);
}

/**
 * Puts the viewer's head at a place inside, enlarged, looking in a direction, both in the world's own frame. What lies there
 * comes to lie a little below the line of sight.
 */
export function inside(out: Similarity, head: Head, place: Vector3, direction: Vector3): Similarity {
  levelForward(head, work.forward);
  work.forward.y = -Math.tan(LOOK_DOWN_RAD);
  turnTo(work.to, work.forward, UP);
  turnTo(work.from, direction, UP);
  out.orientation.copy(work.to).multiply(work.from.conjugate());
  out.scale = INSIDE_SCALE;
  return out.pin(place, work.target.copy(head.position));
}

/** Writes the turn that takes -z to a direction and +y as near to `up` as can be. */
function turnTo(out: Quaternion, direction: Vector3, up: Vector3): void {
  const { up: above, side, matrix } = work;
  const back = work.target.copy(direction).normalize().negate();
  above.copy(up);
  if (Math.abs(back.dot(up)) > 0.98) above.set(1, 0, 0); // straight up or down: any way round will do
  side.crossVectors(above, back).normalize();
  above.crossVectors(back, side);
  matrix.makeBasis(side, above, back);
  out.setFromRotationMatrix(matrix);
}
