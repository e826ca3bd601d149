/**
 * Takes the shimmer of measurement out of a catheter at rest, and stands aside while it moves.
 *
 * What it is made for, measured on Tracks of the twin over the WebSocket (`cathxr run`, 700 Tracks at 30 Hz each):
 *
 * | scene | tip, per axis | correlated from Track to Track | tip's direction, per axis | sigma_mm told | entry, all axes |
 * |---|---|---|---|---|---|
 * | rest (30 mm in) | 0.001 to 0.003 mm | 0.02 | 1.5 mrad | 0.03 mm | 0.03 mm |
 * | still (80 mm in, flexed) | 0.003 to 0.004 mm | -0.01 | 2.1 mrad | 0.045 mm | 0.02 mm |
 *
 * So the noise is white, sigma_mm (which holds the calibration's share as well, and that does not shimmer) is 6 to 10 times
 * the tip's scatter, and the direction is what shimmers: 3 mrad are 0.3 mm at the far end of a beam of 90 mm. Real cameras
 * will be noisier by an unknown factor, so that the noise s per axis is followed (`NoiseLevel`; at most sigma_mm / sqrt 3,
 * what sigma_mm would be if it were all scatter) and everything else is in units of s:
 *
 * * A change that could be noise alone goes through a first-order low-pass of REST_HZ. At interval dt it lets through
 *   a = 1 - exp(-2 pi REST_HZ dt) and leaves sqrt(a / (2 - a)) of the noise: 0.18 at 60 Hz, 0.25 at 30 Hz, 0.43 at 10 Hz.
 *   0.02 mm RMS at rest therefore hold up to s = 0.08 mm at 30 Hz, 20 times the twin's.
 * * What is drawn is never further than LEASH s from what was measured. Noise in three directions is within 4 s in 99.9 %.
 *   At a speed v this alone bounds the lag by 4 s / v: with the twin's s 8 ms at 2 mm/s, 0.1 ms at 150 mm/s; 20 ms at 2 mm/s
 *   hold up to s = 0.01 mm.
 * * A speed beyond what noise can seem to have raises the frequency so that the lag is about s (one-euro filter, Casiez et
 *   al. 2012). The speed is low-passed with SPEED_HZ; white noise then seems to move at 2 pi SPEED_HZ s = 8 s a second per
 *   axis at any rate of Tracks, and within NOISE_SPEED = 25 s a second in 99 % in all three.
 * * The tip's direction is treated in the same way with a noise of its own, and counts as turning where the tip moves
 *   across a lever of LEVER_MM: the tip's place tells of a bend sooner than the direction does.
 *
 * It works on the Tracks as they come, so that the display's rate does not matter.
 */

import { angleBetween, slerpInto, turnAboutZInto } from "../maths/rotation";
import { NoiseLevel } from "./noise_level";
import { Snapshot } from "./snapshot";

const REST_HZ = 0.6;
const SPEED_HZ = 1.2;
const LEASH = 4;
const NOISE_SPEED = 25;
const LEVER_MM = 20;
/** Noise per axis: least and first, mm; where no sigma_mm is told, at most. */
const TIP_MM = { least: 0.001, first: 0.004, most: 0.1 };
const TURN_RAD = { least: 0.0003, first: 0.002, most: 0.02 };
/** The encoder does not shimmer but may flicker by a count: 1.3 mrad with 2400 counts a turn geared 2 to 1. */
const ROLL_LEASH_RAD = 0.002;
/** A gap this long is no rest. */
const GAP_S = 0.3;
/** Of the curve, beside the tip, these are on the leash as well: it may move where its tip does not. */
const QUARTERS = [0.25, 0.5, 0.75] as const;

/** Two instants' measurements of one vector, and how fast it seems to change. */
class Course {
  readonly last = new Float64Array(3);
  private readonly before = new Float64Array(3);
  private readonly velocity = new Float64Array(3);

  begin(at: Float64Array): void {
    this.velocity.fill(0);
    this.last.set(at);
  }

  /** Takes the next one; ratio: its interval over the one before, 0: there was none. */
  step(at: Float64Array, dt: number, ratio: number, noise: NoiseLevel, most: number): void {
    const believed = 1 - Math.exp(-2 * Math.PI * SPEED_HZ * dt);
    let squared = 0;
    for (let axis = 0; axis < 3; axis++) {
      const step = at[axis]! - this.last[axis]!;
      squared += (step - ratio * (this.last[axis]! - this.before[axis]!)) ** 2;
      this.velocity[axis]! += believed * (step / dt - this.velocity[axis]!);
      this.before[axis] = this.last[axis]!;
      this.last[axis] = at[axis]!;
    }
    if (ratio > 0) noise.step(squared, ratio, most);
  }

  /** The speed beyond what noise can seem to have. */
  speed(noise: NoiseLevel): number {
    const x = this.velocity[0]!, y = this.velocity[1]!, z = this.velocity[2]!;
    return Math.max(0, Math.sqrt(x * x + y * y + z * z) - NOISE_SPEED * noise.value);
  }
}

export class RestFilter {
  private readonly shown = new Snapshot();
  private readonly tipNoise = new NoiseLevel(3, TIP_MM.least, TIP_MM.first);
  private readonly turnNoise = new NoiseLevel(2, TURN_RAD.least, TURN_RAD.first);
  private readonly tip = new Course();
  private readonly way = new Course();
  private readonly direction = new Float64Array(3);
  private readonly unrolled = new Float64Array(4);
  private readonly shownUnrolled = new Float64Array(4);
  private dtBefore = 0;
  private empty = true;

  /** Begins anew; what is known of the noise stays, until `forget`. */
  clear(): void {
    this.empty = true;
  }

  /** Begins anew with another stream. */
  forget(): void {
    this.empty = true;
    this.tipNoise.clear();
    this.turnNoise.clear();
  }

  /** The tip's noise per axis as it is followed now, mm. */
  get noiseMm(): number {
    return this.tipNoise.value;
  }

  /** Changes a Track in place. A lost one, a gap, another number of points, and roll coming or going begin anew. */
  apply(now: Snapshot): void {
    const { shown } = this;
    if (now.status === "lost") {
      this.empty = true;
      return;
    }
    const dt = now.t - shown.t;
    directionInto(this.direction, now.orientation);
    const other = shown.count !== now.count || (shown.roll === null) !== (now.roll === null);
    if (this.empty || other || dt <= 0 || dt > GAP_S) {
      this.empty = false;
      this.dtBefore = 0;
      this.tip.begin(now.tip);
      this.way.begin(this.direction);
    } else {
      this.measure(now, dt);
      this.smooth(now, dt);
    }
    shown.copy(now);
    shown.t = now.t;
  }

  private measure(now: Snapshot, dt: number): void {
    const ratio = this.dtBefore > 0 ? dt / this.dtBefore : 0;
    const most = now.sigmaMm === null ? TIP_MM.most : Math.max(TIP_MM.least, now.sigmaMm / Math.sqrt(3));
    this.tip.step(now.tip, dt, ratio, this.tipNoise, most);
    this.way.step(this.direction, dt, ratio, this.turnNoise, TURN_RAD.most);
    this.dtBefore = dt;
  }

  /** Moves what was shown towards what is measured, and writes it to the Track. */
  private smooth(now: Snapshot, dt: number): void {
    const { shown, unrolled, shownUnrolled, tipNoise, turnNoise } = this;
    const speed = this.tip.speed(tipNoise);
    const share = shareOf(speed, tipNoise.value, this.off(now), dt);
    for (let i = 0; i < 3 * now.count; i++) now.points[i] = shown.points[i]! + share * (now.points[i]! - shown.points[i]!);
    for (let axis = 0; axis < 3; axis++) now.tip[axis] = shown.tip[axis]! + share * (now.tip[axis]! - shown.tip[axis]!);
    turnAboutZInto(unrolled, now.orientation, -(now.roll ?? 0));
    turnAboutZInto(shownUnrolled, shown.orientation, -(shown.roll ?? 0));
    const turning = Math.max(this.way.speed(turnNoise), speed / LEVER_MM);
    const turned = shareOf(turning, turnNoise.value, angleBetween(shownUnrolled, unrolled), dt);
    slerpInto(now.orientation, shownUnrolled, unrolled, turned);
    if (now.roll === null || shown.roll === null) return;
    const off = Math.abs(now.roll - shown.roll);
    now.roll = shown.roll + leashed(1 - Math.exp(-2 * Math.PI * REST_HZ * dt), ROLL_LEASH_RAD, off) * (now.roll - shown.roll);
    turnAboutZInto(now.orientation, now.orientation, now.roll);
  }

  /** Returns how far the measurement is from what was shown, mm: the farthest of the tip and a few places of the curve. */
  private off(now: Snapshot): number {
    const { shown } = this;
    let most = apart(now.tip, shown.tip, 0);
    for (let i = 0; i < QUARTERS.length; i++) {
      most = Math.max(most, apart(now.points, shown.points, 3 * Math.round(QUARTERS[i]! * (now.count - 1))));
    }
    return most;
  }
}

/** Returns how much of a measurement is taken, 0 to 1. speed and off in the units of the noise. */
function shareOf(speed: number, noise: number, off: number, dt: number): number {
  const share = 1 - Math.exp(-dt * (2 * Math.PI * REST_HZ + speed / noise));
  return leashed(share, LEASH * noise, off);
}

/** Raises a share so far that no more than the leash is left. */
function leashed(share: number, leash: number, off: number): number {
  return off > leash ? Math.max(share, 1 - leash / off) : share;
}

function apart(a: Float64Array, b: Float64Array, at: number): number {
  const x = a[at]! - b[at]!, y = a[at + 1]! - b[at + 1]!, z = a[at + 2]! - b[at + 2]!;
  return Math.sqrt(x * x + y * y + z * z);
}

/** Writes a quaternion's z axis. */
function directionInto(out: Float64Array, q: Float64Array): void {
  const w = q[0]!, x = q[1]!, y = q[2]!, z = q[3]!;
  out[0] = 2 * (x * z + w * y);
  out[1] = 2 * (y * z - w * x);
  out[2] = 1 - 2 * (x * x + y * y);
}
