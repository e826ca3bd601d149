/** Numbers that look random and are the same at every run. */

import { Quaternion, Vector3 } from "three";

/** Returns a source of numbers from 0 to 1 (a 32-bit mixing generator). */
export function makeRandom(seed: number): () => number {
  let state = seed >>> 0;
  return () => {
    state = (state + 0x6d2b79f5) >>> 0;
    let mixed = Math.imul(state ^ (state >>> 15), state | 1);
    mixed ^= mixed + Math.imul(mixed ^ (mixed >>> 7), mixed | 61);
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 4294967296;
  };
}

export function someVector(random: () => number): Vector3 {
  return new Vector3(random() - 0.5, random() - 0.5, random() - 0.5).multiplyScalar(2);
}

export function someQuaternion(random: () => number): Quaternion {
  return new Quaternion(random() - 0.5, random() - 0.5, random() - 0.5, random() - 0.5).normalize();
}
