/** Small figures and switches of what is drawn in a session. */

import { Mesh } from "three";
import type { Material, Object3D } from "three";
import type { DrawnTrack } from "../motion/drawn";

/** Returns the length of the drawn catheter, mm. */
export function lengthOf({ points, count }: DrawnTrack): number {
  let length = 0;
  for (let i = 3; i < 3 * count; i += 3) {
    length += Math.hypot(points[i]! - points[i - 3]!, points[i + 1]! - points[i - 2]!, points[i + 2]! - points[i - 1]!);
  }
  return length;
}

/** Lets a thing be drawn over what is nearer; looks only when that changes. */
export function drawBefore(thing: Object3D, before: boolean): void {
  if ((thing.userData["before"] ?? false) === before) return;
  thing.userData["before"] = before;
  thing.traverse((node) => {
    if (node instanceof Mesh) (node.material as Material).depthTest = !before;
  });
}
