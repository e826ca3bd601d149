/** A pose that glides after another one: critically damped, so that it comes close fast and never swings past. */

import { Quaternion, Vector3 } from "three";

export class Glide {
  readonly position = new Vector3();
  readonly orientation = new Quaternion();
  private readonly wantedPosition = new Vector3();
  private readonly wantedOrientation = new Quaternion();
  private readonly velocity = new Vector3();
  private readonly spin = new Vector3();
  private readonly off = new Vector3();
  private readonly turn = new Vector3();
  private readonly push = new Vector3();
  private readonly error = new Quaternion();

  /** stiffness: per second; what is left of a distance is under 1 % after 7 / stiffness seconds. */
  constructor(private readonly stiffness: number) {}

  /** Begins at a pose, at rest. */
  start(position: Vector3, orientation: Quaternion): void {
    this.position.copy(position);
    this.orientation.copy(orientation);
    this.wantedPosition.copy(position);
    this.wantedOrientation.copy(orientation);
    this.velocity.set(0, 0, 0);
    this.spin.set(0, 0, 0);
  }

  /** Says where to glide to from now on. */
  aim(position: Vector3, orientation: Quaternion): void {
    this.wantedPosition.copy(position);
    this.wantedOrientation.copy(orientation);
  }

  /** Moves on by a time; returns whether there is still a way to go. */
  step(seconds: number): boolean {
    this.off.subVectors(this.position, this.wantedPosition);
    this.ease(this.off, this.velocity, seconds);
    this.position.addVectors(this.wantedPosition, this.off);
    this.error.copy(this.wantedOrientation).invert().premultiply(this.orientation);
    rotationVector(this.error, this.turn);
    this.ease(this.turn, this.spin, seconds);
    fromRotationVector(this.turn, this.error);
    this.orientation.multiplyQuaternions(this.error, this.wantedOrientation).normalize();
    const moving = this.off.lengthSq() + this.turn.lengthSq() > 1e-10 || this.velocity.lengthSq() + this.spin.lengthSq() > 1e-10;
    return moving;
  }

  /** The exact solution of the critically damped spring over one step. */
  private ease(off: Vector3, velocity: Vector3, seconds: number): void {
    const w = this.stiffness;
    const left = Math.exp(-w * seconds);
    this.push.copy(velocity).addScaledVector(off, w).multiplyScalar(seconds);
    velocity.addScaledVector(this.push, -w).multiplyScalar(left);
    off.add(this.push).multiplyScalar(left);
  }
}

/** Writes a rotation's axis times its angle, the short way round, rad. */
export function rotationVector(rotation: Quaternion, out: Vector3): Vector3 {
  const sign = rotation.w < 0 ? -1 : 1;
  const sine = Math.hypot(rotation.x, rotation.y, rotation.z);
  const angle = 2 * Math.atan2(sine, sign * rotation.w);
  return out.set(rotation.x, rotation.y, rotation.z).multiplyScalar(sine < 1e-9 ? 2 * sign : (sign * angle) / sine);
}

export function fromRotationVector(turn: Vector3, out: Quaternion): Quaternion {
  const angle = turn.length();
  const share = angle < 1e-9 ? 0.5 : Math.sin(angle / 2) / angle;
  return out.set(turn.x * share, turn.y * share, turn.z * share, Math.cos(angle / 2)).normalize();
}
