/** What the numbers beside the scene say about the target in force. */

import type { ReachBy } from "../maths/target";

export interface TargetReadout {
  readonly name: string;
  /** Which of the two pairs of figures counts. */
  readonly by: ReachBy;
  /** From the tip to the target's centre. */
  readonly distanceMm: number;
  /** Between the tip's direction and the way to the target, degrees. */
  readonly angleDeg: number;
  /** From the beam's middle line to the target's centre; null without a beam. */
  readonly beamDistanceMm: number | null;
  /** Between the beam's direction and the way from the transducer to the target, degrees; null without a beam. */
  readonly beamAngleDeg: number | null;
  /** Whether the distance that counts, the angle that counts, and so both are good enough now. */
  readonly near: boolean;
  readonly aligned: boolean;
  readonly within: boolean;
  /** How much of the dwell time has passed, 0 to 1. */
  readonly dwelt: number;
  readonly reached: boolean;
}

/** What the numbers say about the wall. */
export interface WallReadout {
  /** off: not asked for; none: this heart has no labels; working: its distances are being worked out. */
  readonly state: "off" | "none" | "working" | "ready";
  /** Points of the catheter that are in the wall. */
  readonly count: number;
  /** How deep the deepest of them is, mm. */
  readonly depthMm: number;
}

/** The same object all the time, brought up to date once a frame. */
export interface SceneReadout {
  /** The target in force; null while targets are off, there are none, or nothing is tracked. */
  readonly target: TargetReadout | null;
  readonly wall: WallReadout;
}
