/** The catheter's surface as flat arrays for the graphics card, rewritten in place for every Track. */

import type { Centreline } from "./centreline";
import { CAP_RINGS, RINGS } from "./centreline";

/** Sides of the tube. One more column of vertices closes the texture's seam. */
export const SIDES = 10;
export const COLUMNS = SIDES + 1;
/** Length of one repeat of the depth marks, mm. */
export const MARK_MM = 10;

const COSINE = Float64Array.from({ length: COLUMNS }, (_, i) => Math.cos((2 * Math.PI * (i % SIDES)) / SIDES));
const SINE = Float64Array.from({ length: COLUMNS }, (_, i) => Math.sin((2 * Math.PI * (i % SIDES)) / SIDES));

export interface TubeArrays {
  readonly position: Float32Array;
  readonly normal: Float32Array;
  readonly uv: Float32Array;
}

/** Returns arrays of the right size; uv's first coordinate (the turn around the tube) is filled in for good. */
export function makeTubeArrays(): TubeArrays {
  const count = RINGS * COLUMNS;
  const uv = new Float32Array(2 * count);
  for (let i = 0; i < count; i++) uv[2 * i] = (i % COLUMNS) / SIDES;
  return { position: new Float32Array(3 * count), normal: new Float32Array(3 * count), uv };
}

/** Returns the triangles, outside facing out. */
export function tubeIndices(): Uint16Array {
  const indices = new Uint16Array((RINGS - 1) * SIDES * 6);
  let at = 0;
  for (let ring = 0; ring < RINGS - 1; ring++) {
    for (let side = 0; side < SIDES; side++) {
      const a = ring * COLUMNS + side;
      const c = a + COLUMNS;
      indices.set([a, c, a + 1, a + 1, c, c + 1], at);
      at += 6;
    }
  }
  return indices;
}

/** Writes the surface around a centreline. uv's second coordinate counts depth marks from the tip. Allocates nothing. */
export function writeTube(arrays: TubeArrays, line: Centreline): void {
  const { position, normal, uv } = arrays;
  for (let ring = 0; ring < RINGS; ring++) {
    const at = 3 * ring;
    const radius = line.radius[ring]!;
    const out = line.lean[ring]!;
    const ahead = ring < CAP_RINGS ? Math.sqrt(1 - out * out) : 0;
    const mark = line.along[ring]! / MARK_MM;
    for (let column = 0; column < COLUMNS; column++) {
      const vertex = ring * COLUMNS + column;
      const c = COSINE[column]!;
      const s = SINE[column]!;
      for (let axis = 0; axis < 3; axis++) {
        const radial = c * line.beam[at + axis]! + s * line.side[at + axis]!;
        position[3 * vertex + axis] = line.position[at + axis]! + radius * radial;
        normal[3 * vertex + axis] = out * radial + ahead * line.forward[at + axis]!;
      }
      uv[2 * vertex + 1] = mark;
    }
  }
}
