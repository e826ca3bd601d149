/** The planes that can cut the heart open: one held in a hand, one that the beam lies in. */

import { Vector3 } from "three";
import type { Cut } from "../stage/settings";

/** What lies on the side that the normal points to is taken away. */
export interface CutPlane {
  /** mm, `box`. */
  readonly point: Vector3;
  /** Unit, `box`. */
  readonly normal: Vector3;
  /** Whether whoever sets it has one now. */
  readonly valid: boolean;
}

interface OwnPlane extends CutPlane {
  valid: boolean;
}

export type CutBy = Exclude<Cut, "off">;

/** Set by whoever has the plane (the hand, the beam); the setting `cut` says which one cuts. */
export class CutPlanes {
  private readonly planes: Readonly<Record<CutBy, OwnPlane>> = { hand: makePlane(), beam: makePlane() };

  /** point: mm, `box`; normal: any length but 0, `box`, towards what is taken away. Both are copied. */
  set(by: CutBy, point: Vector3, normal: Vector3): void {
    const plane = this.planes[by];
    plane.point.copy(point);
    plane.normal.copy(normal).normalize();
    plane.valid = plane.normal.lengthSq() > 0.5;
  }

  /** Says that there is no such plane now. */
  release(by: CutBy): void {
    this.planes[by].valid = false;
  }

  get(by: CutBy): CutPlane {
    return this.planes[by];
  }
}

function makePlane(): OwnPlane {
  return { point: new Vector3(), normal: new Vector3(0, 0, 1), valid: false };
}
