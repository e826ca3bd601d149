/** Holding the world: one hand moves and turns it, two hands also scale it. Pure geometry, metres, in the room's frame. */

import { Quaternion, Vector3 } from "three";
import { Similarity } from "./similarity";

export const SCALE_LIMITS: readonly [number, number] = [0.5, 30];
/** Let go of this near to upright, the world rights itself. */
const UPRIGHT_WITHIN_RAD = (14 * Math.PI) / 180;
const RIGHTING_MS = 280;
/** Hands nearer to each other than this say nothing about size. */
const LEAST_SPAN_M = 0.02;
const UP = new Vector3(0, 1, 0);

/** Where a hand is, by what it holds with. */
export interface Holder {
  readonly position: Vector3;
  readonly orientation: Quaternion;
}

const work = {
  a: new Vector3(), b: new Vector3(), now: new Vector3(), middle: new Vector3(),
  turn: new Quaternion(), twist: new Quaternion(), delta: new Quaternion(), hand: new Similarity(),
};

export class Grab {
  /** How the world stands. To be read after `update`; to be written only through `place`. */
  readonly world = new Similarity();
  private readonly holders: Holder[] = [];
  /** One hand: hand_from_world at the grab. Two: the world at the grab. */
  private readonly start = new Similarity();
  /** Two hands: the world's point between them, their distance, and the turn so far. */
  private readonly pivot = new Vector3();
  private span = 1;
  private readonly turned = new Quaternion();
  private readonly along = new Vector3();
  private readonly before: readonly [Quaternion, Quaternion] = [new Quaternion(), new Quaternion()];
  private readonly righting = { from: new Quaternion(), to: new Quaternion(), world: new Vector3(), room: new Vector3(), sinceMs: -1 };

  get hands(): number {
    return this.holders.length;
  }

  holds(holder: Holder): boolean {
    return this.holders.includes(holder);
  }

  /** Takes hold with one more hand, at most two. What is held does not jump: it goes on from where it is. */
  take(holder: Holder): void {
    if (this.holders.length === 2 || this.holds(holder)) return;
    this.holders.push(holder);
    this.righting.sinceMs = -1;
    this.anchor();
  }

  /** Lets go with one hand; `nowMs` is when, for what follows of itself. */
  release(holder: Holder, nowMs: number): void {
    const index = this.holders.indexOf(holder);
    if (index < 0) return;
    this.holders.splice(index, 1);
    if (this.holders.length > 0) this.anchor();
    else this.beginRighting(holder.position, nowMs);
  }

  releaseAll(): void {
    this.holders.length = 0;
    this.righting.sinceMs = -1;
  }

  /** Puts the world somewhere; hands that hold it go on holding it from there. */
  place(world: Similarity): void {
    this.world.copy(world);
    this.righting.sinceMs = -1;
    if (this.holders.length > 0) this.anchor();
  }

  /** Moves the world on with the hands; returns whether it moved. */
  update(nowMs: number): boolean {
    const [first, second] = this.holders;
    if (first === undefined) return this.right(nowMs);
    if (second === undefined) this.world.set(first.position, first.orientation).multiply(this.start);
    else this.withTwo(first, second);
    return true;
  }

  private anchor(): void {
    const [first, second] = this.holders;
    if (first === undefined) return;
    if (second === undefined) {
      this.start.copy(work.hand.set(first.position, first.orientation).invert().multiply(this.world));
      return;
    }
    this.start.copy(this.world);
    this.along.subVectors(second.position, first.position);
    this.span = Math.max(LEAST_SPAN_M, this.along.length());
    this.along.normalize();
    this.turned.identity();
    this.before[0].copy(first.orientation);
    this.before[1].copy(second.orientation);
    this.pivot.addVectors(first.position, second.position).multiplyScalar(0.5);
    this.world.applyInverse(this.pivot);
  }

  private withTwo(first: Holder, second: Holder): void {
    const { now, middle, turn, twist } = work;
    now.subVectors(second.position, first.position);
    const span = Math.max(LEAST_SPAN_M, now.length());
    if (now.lengthSq() > LEAST_SPAN_M * LEAST_SPAN_M) {
      now.normalize();
      turn.setFromUnitVectors(this.along, now);
      const about = 0.5 * (this.twistOf(0, first, now) + this.twistOf(1, second, now));
      this.turned.premultiply(turn).premultiply(twist.setFromAxisAngle(now, about)).normalize();
      this.along.copy(now);
    }
    this.before[0].copy(first.orientation);
    this.before[1].copy(second.orientation);
    middle.addVectors(first.position, second.position).multiplyScalar(0.5);
    this.world.orientation.multiplyQuaternions(this.turned, this.start.orientation).normalize();
    this.world.scale = clampScale((this.start.scale * span) / this.span);
    this.world.pin(this.pivot, middle);
  }

  /** Returns how far a hand has turned about an axis since the frame before, rad. */
  private twistOf(index: 0 | 1, holder: Holder, axis: Vector3): number {
    const delta = work.delta.copy(this.before[index]).conjugate().premultiply(holder.orientation);
    const along = delta.x * axis.x + delta.y * axis.y + delta.z * axis.z;
    const angle = 2 * Math.atan2(along, delta.w);
    return angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI));
  }

  private beginRighting(at: Vector3, nowMs: number): void {
    const { righting } = this;
    const up = work.a.copy(UP).applyQuaternion(this.world.orientation);
    const tilt = up.angleTo(UP);
    if (tilt < 1e-4 || tilt > UPRIGHT_WITHIN_RAD) return;
    righting.from.copy(this.world.orientation);
    righting.to.copy(this.world.orientation).premultiply(work.turn.setFromUnitVectors(up, UP)).normalize();
    righting.room.copy(at);
    this.world.applyInverse(righting.world.copy(at));
    righting.sinceMs = nowMs;
  }

  /** Turns a world that was let go nearly upright about the place of the hand until it is. */
  private right(nowMs: number): boolean {
    const { righting } = this;
    if (righting.sinceMs < 0) return false;
    const share = Math.min(1, (nowMs - righting.sinceMs) / RIGHTING_MS);
    this.world.orientation.slerpQuaternions(righting.from, righting.to, share * share * (3 - 2 * share));
    this.world.pin(righting.world, righting.room);
    if (share >= 1) righting.sinceMs = -1;
    return true;
  }
}

export function clampScale(scale: number): number {
  return Math.min(SCALE_LIMITS[1], Math.max(SCALE_LIMITS[0], scale));
}
