/** A catheter's motion as Tracks that come over a link, and what is drawn of them. */

import { Euler, Quaternion as Turn } from "three";
import type { Quaternion, TrackMessage, Vector3 } from "../src/generated/messages";
import { Interpolator } from "../src/motion/interpolator";
import { makeRandom } from "./random";

export const K = 12;
/** Host's clock minus the page's, s. */
export const HOST = 5000;
export const DISPLAY_S = 1 / 90;

export interface Pose {
  readonly tip: Vector3;
  readonly roll: number | null;
  /** Turn of the tip's direction about the box's y axis, rad. */
  readonly bend?: number;
  /** And then about its x axis, rad. */
  readonly nod?: number;
}
export type Motion = (t: number) => Pose;

export function track(seq: number, t: number, pose: Pose, more: Partial<TrackMessage> = {}): TrackMessage {
  const [x, y, z] = pose.tip;
  const points = Array.from({ length: K }, (_, i): Vector3 => {
    const share = 1 - i / (K - 1);
    return [x * share, y * share ** 2, z * share ** 2];
  });
  return {
    type: "track", seq, t, status: "tracked", reason: "", points, tip: { position: pose.tip, orientation_wxyz: turned(pose.bend ?? 0, pose.nod ?? 0, pose.roll ?? 0) },
    roll: pose.roll, roll_predicted: false, yaw: 0, pitch: 0, sigma_mm: 0.1, latency_ms: 20, ...more,
  };
}

/** A turn about y, then one about the turned x, then one about the z that comes of it. */
function turned(bend: number, nod: number, roll: number): Quaternion {
  const { w, x, y, z } = new Turn().setFromEuler(new Euler(nod, bend, roll, "YXZ"));
  return [w, x, y, z];
}

/** Returns normally distributed numbers from even ones (Box and Muller). */
export const normalFrom = (random: () => number) => (): number => Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());

export interface Arrival { readonly atS: number; readonly track: TrackMessage }
export interface Course {
  readonly rateHz: number;
  readonly seconds: number;
  readonly motion: Motion;
  /** From mid-exposure to the page, s. */
  readonly journey: (random: () => number) => number;
  readonly loss?: number;
  /** Share of the Tracks that come twice. */
  readonly twice?: number;
  readonly overtake?: boolean;
  /** Of the tip and of its direction (rad), per axis. */
  readonly noiseMm?: number;
  readonly noiseRad?: number;
  readonly sigmaMm?: number | null;
}

export function arrivals(course: Course, seed: number): Arrival[] {
  const random = makeRandom(seed);
  const normal = normalFrom(random);
  const made: Arrival[] = [];
  let last = 0;
  for (let seq = 0; seq < course.seconds * course.rateHz; seq++) {
    const s = seq / course.rateHz;
    const pose = course.motion(s);
    const tip = pose.tip.map((value) => value + (course.noiseMm ?? 0) * normal()) as Vector3;
    const bend = (pose.bend ?? 0) + (course.noiseRad === undefined ? 0 : course.noiseRad * normal());
    const nod = course.noiseRad === undefined ? 0 : course.noiseRad * normal();
    if (random() < (course.loss ?? 0)) continue;
    let atS = s + course.journey(random);
    if (course.overtake !== true) atS = last = Math.max(last + 1e-4, atS); // a stream keeps its order
    const sent = track(seq, HOST + s, { tip, roll: pose.roll, bend, nod }, { sigma_mm: course.sigmaMm === undefined ? 0.1 : course.sigmaMm });
    made.push({ atS, track: sent });
    if (random() < (course.twice ?? 0)) made.push({ atS: atS + 5e-5, track: sent });
  }
  return made.sort((a, b) => a.atS - b.atS);
}

export interface Shown {
  readonly nowS: number;
  readonly t: number;
  readonly tip: Vector3;
  /** Of the tip's direction about y, rad. */
  readonly bend: number;
  readonly status: string;
  readonly extrapolated: boolean;
}

/** Draws a course at the display's rate from `fromS` on. */
export function play(course: Course, seed: number, fromS = 0, motion = new Interpolator()): Shown[] {
  const shown: Shown[] = [];
  const coming = arrivals(course, seed);
  let next = 0;
  for (let nowS = 0; nowS < course.seconds; nowS += DISPLAY_S) {
    for (; next < coming.length && coming[next]!.atS <= nowS; next++) motion.put(coming[next]!.track, coming[next]!.atS);
    const drawn = motion.sample(nowS, HOST);
    if (drawn === null || nowS < fromS) continue;
    const [w, x, y, z] = drawn.orientation as unknown as Quaternion;
    const bend = Math.atan2(2 * (x * z + w * y), 1 - 2 * (x * x + y * y));
    const tip = [...drawn.tip] as unknown as Vector3;
    shown.push({ nowS, t: drawn.t - HOST, tip, bend, status: drawn.status, extrapolated: drawn.extrapolated });
  }
  return shown;
}

export const distance = (a: ArrayLike<number>, b: ArrayLike<number>): number => Math.hypot(a[0]! - b[0]!, a[1]! - b[1]!, a[2]! - b[2]!);
/** Along x from 20 mm on, mm/s. */
export const pushed = (speed: number): Motion => (t) => ({ tip: [20 + speed * t, 5, -8], roll: null });
export const still: Motion = () => ({ tip: [60, 5, -8], roll: 0.3 });
