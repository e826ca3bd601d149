/** Where the tip is drawn: position and orientation, for all that hangs at it. */

import { Matrix4, Quaternion, Vector3 } from "three";
import type { DrawnTrack } from "../motion/drawn";
import type { TipPose } from "../stage/feature";

const ONE = new Vector3(1, 1, 1);

export class Tip implements TipPose {
  readonly matrix = new Matrix4();
  valid = false;
  beam = false;
  private readonly position = new Vector3();
  private readonly orientation = new Quaternion();

  /** Takes what is drawn; a lost catheter leaves the last pose, no longer valid. */
  update(track: DrawnTrack | null): void {
    this.valid = track !== null && track.status !== "lost" && track.count >= 2;
    this.beam = this.valid && track!.roll !== null;
    if (!this.valid) return;
    const { tip, orientation } = track!;
    this.position.set(tip[0]!, tip[1]!, tip[2]!);
    this.orientation.set(orientation[1]!, orientation[2]!, orientation[3]!, orientation[0]!);
    this.matrix.compose(this.position, this.orientation, ONE);
  }
}
