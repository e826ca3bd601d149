/** Where the transducer is: the frame `transducer` (docs/ultrasound.md), from the tip's pose. */

import { Matrix4, Vector3 } from "three";
import type { Quaternion } from "three";

/** From the tip back to the middle of the array, mm: half of an array of 7 mm behind a rounded end of 1.5 mm. */
export const ARRAY_BEHIND_TIP_MM = 5;

const ONE = new Vector3(1, 1, 1);

/** Returns tip_from_transducer, mm, for a catheter of a radius in mm. */
export function tipFromTransducer(radiusMm: number): Matrix4 {
  return new Matrix4().makeTranslation(radiusMm, 0, -ARRAY_BEHIND_TIP_MM);
}

/** Writes a rigid transform. */
export function rigid(out: Matrix4, position: Vector3, orientation: Quaternion): Matrix4 {
  return out.compose(position, orientation, ONE);
}
