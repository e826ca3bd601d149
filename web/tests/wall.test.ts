import { Matrix4 } from "three";
import { describe, expect, it, vi } from "vitest";
import type { DistanceField } from "../src/maths/distance_field";
import { bloodVoxels, distanceAt, distanceField, UNKNOWN } from "../src/maths/distance_field";
import type { Mouth, WallContact } from "../src/maths/wall_contact";
import { openEnds, wallContact } from "../src/maths/wall_contact";

vi.setConfig({ testTimeout: 120_000 }); // a limit on hanging, on a machine that does other things too

const BLOOD = 3;
const TISSUE = 9;
type Point = [number, number, number];

/** A volume of 48 x 40 x 44 voxels of 0.8, 1, 0.9 mm, labelled by what a function says of a voxel's place, mm in `ct`. */
function labelled(labelAt: (x: number, y: number, z: number) => number, turned = false): DistanceField {
  const size: Point = [48, 40, 44];
  const spacing: Point = [0.8, 1, 0.9];
  const placed = new Matrix4().makeTranslation(-19, -20, -20).scale({ x: spacing[0], y: spacing[1], z: spacing[2] } as never);
  if (turned) placed.premultiply(new Matrix4().makeRotationZ(0.4));
  const bytes = new Uint8Array(size[0] * size[1] * size[2]);
  const e = placed.elements;
  let at = 0;
  for (let k = 0; k < size[2]; k++) for (let j = 0; j < size[1]; j++) for (let i = 0; i < size[0]; i++) {
    bytes[at++] = labelAt(
      e[0]! * i + e[4]! * j + e[8]! * k + e[12]!,
      e[1]! * i + e[5]! * j + e[9]! * k + e[13]!,
      e[2]! * i + e[6]! * j + e[10]! * k + e[14]!,
    );
  }
  return distanceField(bloodVoxels(bytes, size, placed.clone().transpose().elements, new Set([BLOOD])));
}

const R = 14;
const sphere = (x: number, y: number, z: number): number => (Math.hypot(x, y, z) < R ? BLOOD : Math.hypot(x, y, z) < R + 3 ? TISSUE : 0);

describe("distanceField", () => {
  it.each([[false], [true]])("is that of a sphere, inside and out, between voxels too (turned: %s)", (turned) => {
    const field = labelled(sphere, turned);
    let worst = 0;
    for (let r = 0; r <= R + 0; r += 0.7) {
      for (const [a, b] of [[0, 0], [1, 0.3], [2.5, -0.8], [4, 1.1]] as const) {
        const place: Point = [r * Math.cos(a) * Math.cos(b), r * Math.sin(a) * Math.cos(b), r * Math.sin(b)];
        const found = distanceAt(field, ...place);
        if (found !== UNKNOWN) worst = Math.max(worst, Math.abs(found - (R - r)));
      }
    }
    expect(worst).toBeLessThan(0.9); // a wall made of voxels is known to half a voxel's diagonal: 0.78 mm, and the middle's cusp
  });

  it("knows nothing outside the blood's extent", () => {
    const field = labelled(sphere);
    expect(distanceAt(field, R + 2, 0, 0)).toBe(UNKNOWN);
    expect(distanceAt(field, 100, 0, 0)).toBe(UNKNOWN);
  });

  it("is exact against trying every voxel", () => {
    const size: Point = [7, 6, 5];
    const spacing: Point = [0.5, 1, 2];
    const bytes = Uint8Array.from({ length: 210 }, (_, i) => ((i * 2654435761) >>> 13) % 5 === 0 ? BLOOD : 0);
    const voxels = bloodVoxels(bytes, size, [0.5, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1], new Set([BLOOD]));
    const half = Math.cbrt(1) / 2;
    const { mm } = distanceField(voxels);
    const place = (at: number): Point => [at % 7, Math.floor(at / 7) % 6, Math.floor(at / 42)];
    for (let at = 0; at < 210; at++) {
      let nearest = Infinity;
      for (let other = 0; other < 210; other++) {
        if ((bytes[at] === BLOOD) === (bytes[other] === BLOOD)) continue;
        const [a, b] = [place(at), place(other)];
        nearest = Math.min(nearest, Math.hypot(...a.map((value, axis) => (value - b[axis]!) * spacing[axis]!)));
      }
      expect(mm[at]).toBeCloseTo((bytes[at] === BLOOD ? 1 : -1) * (nearest - half), 4);
    }
  });

  it("makes a volume of too many voxels coarser, in its place", () => {
    const size: Point = [80, 70, 64];
    const bytes = new Uint8Array(size[0] * size[1] * size[2]);
    let at = 0;
    for (let k = 0; k < 64; k++) for (let j = 0; j < 70; j++) for (let i = 0; i < 80; i++) {
      bytes[at++] = (i - 40) ** 2 + (j - 35) ** 2 + (k - 32) ** 2 < 30 ** 2 ? BLOOD : 0;
    }
    const voxels = bloodVoxels(bytes, size, [1, 0, 0, -40, 0, 1, 0, -35, 0, 0, 1, -32, 0, 0, 0, 1], new Set([BLOOD]), 48 ** 3);
    expect(voxels.blood.length).toBeLessThanOrEqual(48 ** 3);
    const field = distanceField(voxels);
    expect(Math.abs(distanceAt(field, 20, 0, 0) - 10)).toBeLessThan(0.9); // half of a voxel that is 1.4 mm now, and its wall
    expect(Math.abs(distanceAt(field, 0, -28, 0) - 2)).toBeLessThan(0.9);
  });

  it("refuses numbers that do not fit", () => {
    expect(() => bloodVoxels(new Uint8Array(7), [2, 2, 2], [], new Set())).toThrow(/8 bytes and have 7/);
  });
});

describe("wallContact", () => {
  const box = new Matrix4();
  const straight = (from: Point, to: Point, count = 41): Float64Array => {
    const points = new Float64Array(3 * count); // tip first
    for (let i = 0; i < count; i++) for (let axis = 0; axis < 3; axis++) points[3 * i + axis] = to[axis]! + (i / (count - 1)) * (from[axis]! - to[axis]!);
    return points;
  };
  const contactOf = (field: DistanceField, ends: Mouth[], points: Float64Array, scale = 1, at = box): WallContact => {
    const out: WallContact = { depths: new Float32Array(200), count: 0, deepestMm: 0 };
    wallContact(out, field, ends, points, points.length / 3, at.elements, scale, 1.5);
    return out;
  };

  it("is none in the middle of the blood, and the radius nearer than the wall is contact", () => {
    const field = labelled(sphere);
    expect(contactOf(field, [], straight([-8, 0, 0], [8, 0, 0])).count).toBe(0);
    const touching = contactOf(field, [], straight([-8, 0, 0], [13.5, 0, 0]));
    expect(touching.count).toBeGreaterThan(0);
    expect(touching.deepestMm).toBeGreaterThan(0.1);
    expect(touching.deepestMm).toBeLessThan(1.8); // 1 mm by geometry, to half a voxel
  });

  it("does not count what has not come into the blood yet", () => {
    const field = labelled(sphere);
    const coming = contactOf(field, [], straight([-30, 0, 0], [0, 0, 0]));
    // From the entry the wall is crossed on the way in; only the last 1.5 mm before the inner side are near it.
    expect(coming.depths[40]).toBe(0);
    expect(coming.count).toBeLessThanOrEqual(3);
  });

  it("gives the depth beyond the wall, in mm of the box", () => {
    const shell = labelled((x, y, z) => (Math.hypot(x, y, z) < 8 || (x > 15 && Math.abs(y) < 3 && Math.abs(z) < 3) ? BLOOD : 0));
    const pushed = contactOf(shell, [], straight([0, 0, 0], [12, 0, 0]));
    expect(pushed.deepestMm).toBeGreaterThan(4);
    expect(pushed.deepestMm).toBeLessThan(5.5); // 12 - 8 + 1.5 - half a voxel... towards the second cavity it is 3 + 1.5
    const half = contactOf(shell, [], straight([0, 0, 0], [6, 0, 0]), 2, new Matrix4().makeScale(2, 2, 2));
    expect(half.deepestMm).toBeGreaterThan(1.5 + 1);
    expect(half.deepestMm).toBeLessThan(1.5 + 2.4);
  });

  it("leaves out the continuation of an open end, and knows a valve from one", () => {
    // Two cavities joined by a neck at x = 0 (a valve); the left one ends openly at x = -14.
    const field = labelled((x, y, z) => (Math.abs(x) < 14 && Math.hypot(y, z) < 6 ? BLOOD : x > 16 && x < 17 ? BLOOD : x < -18.5 ? BLOOD : 0));
    const valve: Mouth = { at: [0, 0, 0], out: [1, 0, 0], radiusMm: 6 };
    const end: Mouth = { at: [-14, 0, 0], out: [-1, 0, 0], radiusMm: 6 };
    expect(openEnds(field, [valve, end])).toEqual([end]);
    const leaving = straight([10, 0, 0], [-17, 0, 0]);
    expect(contactOf(field, [], leaving).count).toBeGreaterThan(0);
    expect(contactOf(field, [end], leaving).count).toBe(0);
    const beside = straight([0, 0, 0], [-10, 8, 0]);
    expect(contactOf(field, [end], beside).count).toBeGreaterThan(0);
  });
});
