/** Holds the image's plane still while the catheter is held still, without lagging when it moves. */

import { Matrix4, Quaternion, Vector3 } from "three";
import { rigid } from "./transducer";

/** What the tracker's noise amounts to at rest: less than this is no motion. */
const STILL_MM = 0.06;
const STILL_RAD = 0.004;
/** How much faster than in the time given here nothing is followed within the noise. */
const EASE_S = 1.2;
/** Closer than this to the pose asked for, the image is as good as there. */
const THERE_MM = 0.004;
const THERE_RAD = 0.0003;

/**
 * A pose that follows another: at once where it moves, and ever more slowly the smaller the difference is, down to
 * nothing. What is left out is at most STILL_MM and STILL_RAD, below what the image can show (a sample is 0.2 mm).
 */
export class SteadyPose {
  /** box_from_transducer, held. */
  readonly matrix = new Matrix4();
  private valid = false;
  private readonly position = new Vector3();
  private readonly orientation = new Quaternion();
  private readonly wantedPosition = new Vector3();
  private readonly wantedOrientation = new Quaternion();
  private readonly scale = new Vector3();

  /** Takes the pose as it is (rigid, mm) and the time since the last call; returns whether the held one has moved. */
  follow(wanted: Matrix4, passedS: number): boolean {
    wanted.decompose(this.wantedPosition, this.wantedOrientation, this.scale);
    if (!this.valid) return this.take();
    const offMm = this.position.distanceTo(this.wantedPosition);
    const offRad = this.orientation.angleTo(this.wantedOrientation);
    if (offMm < THERE_MM && offRad < THERE_RAD) return false;
    const beyond = Math.max(offMm / STILL_MM, offRad / STILL_RAD);
    // Beyond the noise, what is left behind is the noise's width; within it, a slow approach that stops when close.
    const share = beyond >= 1 ? 1 - 0.5 / beyond : (1 - Math.exp(-passedS / EASE_S)) * beyond * beyond;
    if (share * Math.max(offMm / THERE_MM, offRad / THERE_RAD) < 0.25) return false;
    this.position.lerp(this.wantedPosition, share);
    this.orientation.slerp(this.wantedOrientation, share);
    rigid(this.matrix, this.position, this.orientation);
    return true;
  }

  /** Forgets: the next pose is taken as it is. */
  reset(): void {
    this.valid = false;
  }

  private take(): boolean {
    this.position.copy(this.wantedPosition);
    this.orientation.copy(this.wantedOrientation);
    rigid(this.matrix, this.position, this.orientation);
    this.valid = true;
    return true;
  }
}
