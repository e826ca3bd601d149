/** Takes the shimmer of measurement out of a catheter at rest, and stands aside while it moves. */

import { angleBetween, slerpInto } from "../maths/rotation";
import { Snapshot } from "./snapshot";

/** At rest: a first-order low-pass of this frequency. */
const REST_HZ = 0.6;
/** Each mm/s beyond the noise raises it by so much: 3 ms of lag at 20 mm/s. */
const HZ_PER_MM_S = 3;
/** Speed that noise alone may seem to have. */
const NOISE_MM_S = 3;
const SPEED_HZ = 1.2;
/** What is drawn is never further than this from what was measured: motion that begins is seen at once. */
const LEASH_MM = 0.25;
const LEASH_RAD = 0.008;
/** Turning is motion as well: at this lever a radian counts as so many mm. */
const LEVER_MM = 12;
/** A gap this long is no rest. */
const GAP_S = 0.3;

/**
 * A one-euro filter (Casiez et al. 2012: the cut-off rises with the speed) on the whole curve, with two changes: a speed
 * that noise may explain counts as none, and a leash bounds the error, so that the onset of a motion does not wait for
 * the speed to be believed. It works on the Tracks as they come, so that the display's rate does not matter.
 */
export class RestFilter {
  private readonly last = new Snapshot();
  private readonly rawTip = new Float64Array(3);
  private readonly rawOrientation = new Float64Array(4);
  private readonly velocity = new Float64Array(3);
  private turning = 0;
  private empty = true;

  clear(): void {
    this.empty = true;
  }

  /** Changes a Track in place. A lost one, a gap, another number of points, and roll coming or going begin anew. */
  apply(now: Snapshot): void {
    const { last } = this;
    const dt = now.t - last.t;
    if (now.status === "lost") {
      this.empty = true;
      return;
    }
    const other = last.count !== now.count || (last.roll === null) !== (now.roll === null);
    if (this.empty || other || dt <= 0 || dt > GAP_S) {
      this.empty = false;
      this.velocity.fill(0);
      this.turning = 0;
      this.keepRaw(now);
    } else {
      const share = this.share(now, dt);
      this.keepRaw(now);
      for (let i = 0; i < 3 * now.count; i++) now.points[i] = last.points[i]! + share * (now.points[i]! - last.points[i]!);
      for (let axis = 0; axis < 3; axis++) now.tip[axis] = last.tip[axis]! + share * (now.tip[axis]! - last.tip[axis]!);
      slerpInto(now.orientation, last.orientation, now.orientation, share);
      if (now.roll !== null && last.roll !== null) now.roll = last.roll + share * (now.roll - last.roll);
    }
    last.copy(now);
    last.t = now.t;
  }

  /** Returns how much of the new measurement is taken, 0 to 1. */
  private share(now: Snapshot, dt: number): number {
    const { last, velocity } = this;
    const believed = 1 - Math.exp(-2 * Math.PI * SPEED_HZ * dt);
    let squared = 0;
    let off = 0;
    for (let axis = 0; axis < 3; axis++) {
      velocity[axis]! += believed * ((now.tip[axis]! - this.rawTip[axis]!) / dt - velocity[axis]!);
      squared += velocity[axis]! ** 2;
      off += (now.tip[axis]! - last.tip[axis]!) ** 2;
    }
    off = Math.sqrt(off);
    const turned = angleBetween(this.rawOrientation, now.orientation);
    this.turning += believed * (turned / dt - this.turning);
    const rollSpeed = now.roll !== null && last.roll !== null ? Math.abs(now.roll - last.roll) / dt : 0;
    const speed = Math.max(Math.sqrt(squared), LEVER_MM * Math.max(0.5 * this.turning, rollSpeed));
    const hz = REST_HZ + HZ_PER_MM_S * Math.max(0, speed - NOISE_MM_S);
    const offRad = angleBetween(last.orientation, now.orientation);
    let share = 1 - Math.exp(-2 * Math.PI * hz * dt);
    if (off > 0) share = Math.max(share, 1 - LEASH_MM / off);
    if (offRad > 0) share = Math.max(share, 1 - LEASH_RAD / offRad);
    return Math.min(1, share);
  }

  private keepRaw(now: Snapshot): void {
    this.rawTip.set(now.tip);
    this.rawOrientation.set(now.orientation);
  }
}
