/** A hand that holds a catheter: its shape by insertion, roll and bends, and what the guide measures of it. */

import { measureBend } from "../src/guide/bend";
import type { Measured, Situation } from "../src/guide/situation";
import { makeRandom } from "./random";

export const FPS = 60;
export const MOUSE: Situation = {
  place: "mouse", mover: "twin", roll: true, heart: true, space: true, free: true, settings: true, ice: true, targets: true,
};
export const RAD = Math.PI / 180;

/** What a hand sets. */
export interface Hand {
  insertion: number;
  roll: number;
  anterior: number;
  left: number;
}

export const COUNT = 50;
export const points = new Float64Array(3 * COUNT);
export const clean = new Float64Array(3 * COUNT);
let shaped = "";

/** Returns a source of normally distributed numbers (Box and Muller). */
export function normals(seed: number): () => number {
  const random = makeRandom(seed);
  return () => Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
}

/**
 * Writes the points of a catheter that enters along +x: a straight shaft, the last 57 mm of which bend evenly (but for
 * 5 mm of stiff end) by anterior and left, both of which turn with the roll. Only what is in the box is bent: the inlet
 * holds the rest straight. By hand from the definition; 0.1 mm steps.
 */
export function shape(hand: Hand): void {
  const key = JSON.stringify(hand);
  if (key !== shaped) bendLine(hand);
  shaped = key;
  points.set(clean);
}

export function bendLine({ insertion, roll, anterior, left }: Hand): void {
  const c = Math.cos(roll * RAD), s = Math.sin(roll * RAD);
  // Roll zero looks along -y; left is z x beam = x-axis cross -y = -z.
  const ky = -(anterior * c - left * s), kz = -(anterior * s + left * c);
  const bend = Math.hypot(ky, kz) * RAD;
  const [ny, nz] = bend > 0 ? [(ky * RAD) / bend, (kz * RAD) / bend] : [0, 0];
  const steps = Math.round(insertion / 0.1);
  let angle = 0, x = 0, across = 0;
  const line: [number, number][] = [[0, 0]];
  for (let i = 0; i < steps; i++) {
    const toTip = insertion - (i + 0.5) * (insertion / steps);
    if (toTip > 5 && toTip < 57) angle += (bend / 52) * (insertion / steps);
    x += Math.cos(angle) * (insertion / steps);
    across += Math.sin(angle) * (insertion / steps);
    line.push([x, across]);
  }
  for (let k = 0; k < COUNT; k++) {
    const [px, pa] = line[Math.round(((COUNT - 1 - k) / (COUNT - 1)) * steps)]!;
    clean[3 * k] = px;
    clean[3 * k + 1] = pa * ny;
    clean[3 * k + 2] = pa * nz;
  }
}

export const bend = { lengthMm: 0, bendDeg: 0, towardsDeg: 0 };

/** Writes what the guide measures of a catheter; noiseMm: of each point. */
export function measure(now: Measured, hand: Hand, known = true, random: (() => number) | null = null, noiseMm = 0.12): void {
  shape(hand);
  if (random !== null) for (let i = 0; i < points.length; i++) points[i]! += noiseMm * random();
  now.known = known;
  now.steered = true;
  if (!known) return;
  measureBend(bend, points, COUNT);
  now.insertedMm = bend.lengthMm;
  now.bendDeg = bend.bendDeg;
  now.bendTowardsDeg = bend.towardsDeg;
  now.rollDeg = hand.roll + (random === null ? 0 : 0.3 * random());
}

export const REST: Hand = { insertion: 70, roll: 10, anterior: 30, left: 0 };
