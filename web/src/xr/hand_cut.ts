/** The plane in the hand that cuts the heart open: what is between it and the hand's back is taken away. */

import type { Object3D } from "three";
import { Matrix4, Vector3 } from "three";
import type { CutPlanes } from "../scene/cut_planes";
import type { Interaction } from "./interaction";
import type { Pointer } from "./pointer";

/** The plane stands this far before a controller. */
const BEFORE_M = 0.08;

export class HandCut {
  private readonly point = new Vector3();
  private readonly normal = new Vector3();
  private readonly boxFromScene = new Matrix4();
  private has = false;

  constructor(private readonly cuts: CutPlanes, private readonly box: Object3D, private readonly interaction: Interaction) {}

  /** Called once a frame; a hand that holds the world or points at a plate leaves the plane where it is, in the heart. */
  update(pointers: readonly Pointer[], wanted: boolean): void {
    if (!wanted) {
      this.release();
      return;
    }
    const hand = this.handOf(pointers);
    if (hand === null || !this.interaction.free(hand)) return;
    if (!this.read(hand)) return;
    this.boxFromScene.copy(this.box.matrixWorld).invert();
    this.point.applyMatrix4(this.boxFromScene);
    this.normal.transformDirection(this.boxFromScene);
    this.cuts.set("hand", this.point, this.normal);
    this.has = true;
  }

  release(): void {
    if (this.has) this.cuts.release("hand");
    this.has = false;
  }

  /** The right hand, or the other one where there is only that. */
  private handOf(pointers: readonly Pointer[]): Pointer | null {
    let found: Pointer | null = null;
    for (const pointer of pointers) {
      if (pointer.tracked && (found === null || !pointer.left)) found = pointer;
    }
    return found;
  }

  /** A controller's plane lies across its ray; a bare hand's is its palm, with what is behind the palm taken away. */
  private read(hand: Pointer): boolean {
    if (!hand.bare) {
      this.point.copy(hand.origin).addScaledVector(hand.direction, BEFORE_M);
      this.normal.copy(hand.direction).negate();
      return true;
    }
    const palm = hand.hand.joints["middle-finger-metacarpal"];
    if (palm?.visible !== true) return false;
    this.point.copy(palm.position);
    this.normal.set(0, 1, 0).applyQuaternion(palm.quaternion); // +y of a hand's joint points out of its back
    return true;
  }
}
