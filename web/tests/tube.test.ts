import { describe, expect, it, vi } from "vitest";
import type { Quaternion, Vector3 } from "../src/maths/pose";
import { CAP_RINGS, Centreline, polylineLength, RINGS } from "../src/maths/centreline";
import { COLUMNS, makeTubeArrays, SIDES, tubeIndices, writeTube } from "../src/maths/tube";

vi.setConfig({ testTimeout: 120_000 }); // a limit on hanging, on a machine that does other things too

const RADIUS = 1.5;
const K = 50;

/** A helix of 25 mm radius, tip first, and its exact tip frame: z forward, x as near to -y as can be. */
function helix(): { points: Vector3[]; orientation: Quaternion; forward: number[] } {
  const at = (s: number): Vector3 => [20 * s, 25 * Math.sin(s) , 25 * (1 - Math.cos(s))];
  const points = Array.from({ length: K }, (_, i) => at(3 * (1 - i / (K - 1))));
  const length = Math.hypot(20, 25);
  const forward = [20 / length, (25 * Math.cos(3)) / length, (25 * Math.sin(3)) / length];
  return { points, orientation: quaternionFor(forward, [0, -1, 0]), forward };
}

function quaternionFor(z: number[], towards: number[]): Quaternion {
  const dot = towards[0]! * z[0]! + towards[1]! * z[1]! + towards[2]! * z[2]!;
  let x = towards.map((value, i) => value - dot * z[i]!);
  const norm = Math.hypot(...x);
  x = x.map((value) => value / norm);
  const y = [z[1]! * x[2]! - z[2]! * x[1]!, z[2]! * x[0]! - z[0]! * x[2]!, z[0]! * x[1]! - z[1]! * x[0]!];
  const w = Math.sqrt(Math.max(0, 1 + x[0]! + y[1]! + z[2]!)) / 2;
  return [w, (y[2]! - z[1]!) / (4 * w), (z[0]! - x[2]!) / (4 * w), (x[1]! - y[0]!) / (4 * w)];
}

function update(line: Centreline, points: readonly Vector3[], orientation: Quaternion): void {
  line.update(Float64Array.from(points.flat()), points.length, Float64Array.from(orientation), RADIUS);
}

function updated(): { line: Centreline; points: Vector3[]; forward: number[] } {
  const { points, orientation, forward } = helix();
  const line = new Centreline();
  update(line, points, orientation);
  return { line, points, forward };
}

const at = (array: Float64Array | Float32Array, i: number): [number, number, number] => [array[3 * i]!, array[3 * i + 1]!, array[3 * i + 2]!];
const distance = (a: ArrayLike<number>, b: ArrayLike<number>): number => Math.hypot(a[0]! - b[0]!, a[1]! - b[1]!, a[2]! - b[2]!);
const dot = (a: ArrayLike<number>, b: ArrayLike<number>): number => a[0]! * b[0]! + a[1]! * b[1]! + a[2]! * b[2]!;

describe("Centreline", () => {
  it("begins at the tip and ends at the entry exactly", () => {
    const { line, points } = updated();
    expect(at(line.position, 0)).toEqual([...points[0]!]);
    expect(distance(at(line.position, RINGS - 1), points[K - 1]!)).toBeLessThan(1e-12);
    expect(line.radius[0]).toBe(0);
  });

  it("stays on the curve that the points were taken from", () => {
    const { line } = updated();
    for (let ring = 0; ring < RINGS; ring++) {
      const [x, y, z] = at(line.position, ring);
      const s = x / 20;
      // A cubic through points 2 mm apart on a 25 mm radius: its error is of order h^4 / r^3 = 0.001 mm, at the ends h^3 / r^2.
      expect(distance([x, y, z], [20 * s, 25 * Math.sin(s), 25 * (1 - Math.cos(s))])).toBeLessThan(0.02);
    }
  });

  it("carries an orthonormal, right-handed frame without twist, from the tip's beam direction on", () => {
    const { line, forward } = updated();
    expect(dot(at(line.forward, 0), forward)).toBeGreaterThan(0.999);
    for (let ring = 0; ring < RINGS; ring++) {
      const [f, b, s] = [at(line.forward, ring), at(line.beam, ring), at(line.side, ring)];
      expect(Math.hypot(...f)).toBeCloseTo(1, 10);
      expect(Math.hypot(...b)).toBeCloseTo(1, 10);
      expect(dot(f, b)).toBeCloseTo(0, 10);
      const cross = [f[1] * b[2] - f[2] * b[1], f[2] * b[0] - f[0] * b[2], f[0] * b[1] - f[1] * b[0]];
      expect(distance(cross, s)).toBeLessThan(1e-9);
      if (ring > CAP_RINGS && ring < RINGS - 1) {
        // Rotation-minimising: the normal's change has no part along the side direction, but for second order terms.
        const before = at(line.beam, ring - 1);
        expect(Math.abs(dot(before, s))).toBeLessThan(2e-4);
      }
    }
  });

  it("keeps the last ring's length equal to the polyline's", () => {
    const { line, points } = updated();
    // The spline is a little longer than its chords: h^2 / (24 r^2) of the length.
    expect(line.along[RINGS - 1]! / polylineLength(points)).toBeCloseTo(1, 3);
  });

  it("draws a stub shorter than its own cap and a beam along the tube without NaN", () => {
    const line = new Centreline();
    update(line, [[0.4, 0, 0], [0, 0, 0]], [Math.SQRT1_2, 0, Math.SQRT1_2, 0]);
    update(line, [[5, 0, 0], [0, 0, 0]], [1, 0, 0, 0]); // identity: beam = x, along the tube
    for (const array of [line.position, line.beam, line.side, line.forward]) {
      expect(array.every(Number.isFinite)).toBe(true);
    }
  });
});

describe("tube", () => {
  it("has all vertices of a ring at the ring's radius and the tip exactly at the tip", () => {
    const { line, points } = updated();
    const arrays = makeTubeArrays();
    writeTube(arrays, line);
    for (let ring = 0; ring < RINGS; ring++) {
      for (let column = 0; column < COLUMNS; column++) {
        const vertex = at(arrays.position, ring * COLUMNS + column);
        // float32 on coordinates up to 75 mm: 4e-6 mm each.
        expect(distance(vertex, at(line.position, ring))).toBeCloseTo(line.radius[ring]!, 4);
      }
    }
    for (let column = 0; column < COLUMNS; column++) expect(distance(at(arrays.position, column), points[0]!)).toBeLessThan(1e-5);
  });

  it("has its most distal vertices on a half sphere that ends in the tip", () => {
    const line = new Centreline();
    const straight: Vector3[] = Array.from({ length: K }, (_, i) => [60 - (60 * i) / (K - 1), 0, 0]);
    update(line, straight, quaternionFor([1, 0, 0], [0, -1, 0]));
    const arrays = makeTubeArrays();
    writeTube(arrays, line);
    for (let i = 0; i < (CAP_RINGS + 1) * COLUMNS; i++) {
      const vertex = at(arrays.position, i);
      expect(vertex[0]).toBeLessThanOrEqual(60 + 1e-5);
      expect(distance(vertex, [60 - RADIUS, 0, 0])).toBeCloseTo(RADIUS, 3);
    }
  });

  it("has its first column of vertices, where the stripe is, towards the beam", () => {
    const line = new Centreline();
    update(line, [[60, 0, 0], [30, 0, 0], [0, 0, 0]], quaternionFor([1, 0, 0], [0, -1, 0]));
    const arrays = makeTubeArrays();
    writeTube(arrays, line);
    const middle = 100 * COLUMNS;
    expect(arrays.position[3 * middle + 1]).toBeCloseTo(-RADIUS, 5);
    expect(arrays.uv[2 * middle]).toBe(0);
    expect(arrays.uv[2 * (middle + SIDES)]).toBe(1);
  });

  it("has triangles that face outwards, with normals that agree", () => {
    const { line } = updated();
    const arrays = makeTubeArrays();
    writeTube(arrays, line);
    const indices = tubeIndices();
    let facing = 0;
    let counted = 0;
    for (let t = 0; t < indices.length; t += 3) {
      const [a, b, c] = [indices[t]!, indices[t + 1]!, indices[t + 2]!].map((i) => at(arrays.position, i)) as unknown as [number[], number[], number[]];
      const u = b.map((value, i) => value - a[i]!);
      const v = c.map((value, i) => value - a[i]!);
      const face = [u[1]! * v[2]! - u[2]! * v[1]!, u[2]! * v[0]! - u[0]! * v[2]!, u[0]! * v[1]! - u[1]! * v[0]!];
      if (Math.hypot(...face) < 1e-6) continue; // the tip's and the lid's degenerate halves
      if (indices[t]! >= (RINGS - 2) * COLUMNS) continue; // the flat lid at the entry has the tube's normals
      counted += 1;
      if (dot(face, at(arrays.normal, indices[t + 1]!)) > 0) facing += 1;
    }
    expect(counted).toBeGreaterThan(3000);
    expect(facing).toBe(counted);
  });
});
