/** A flat picture that stands somewhere: on the desktop page in a frame, in a headset as a plate. */

import type { Group } from "three";

export type PointerPhase = "move" | "press" | "drag" | "release";

export interface Plate {
  /** In its own x-y plane, centred, facing z, `widthM` by `heightM` metres. */
  readonly group: Group;
  readonly widthM: number;
  readonly heightM: number;
  readonly title: string;
  /** Takes a pointer on the plate, u from the left and v from below, 0 to 1; returns whether the plate has a use for it. */
  pointer?(u: number, v: number, phase: PointerPhase): boolean;
}
