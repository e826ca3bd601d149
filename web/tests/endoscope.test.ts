import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { Upright } from "../src/scene/endoscope";
import { relativeDensities } from "../src/scene/heart_look";
import type { TipPose } from "../src/stage/feature";

/** A tip at (60, 5, -8) that looks along `forward`, its beam as near to `beam` as can be. */
function tipAt(forward: Vector3, beam: Vector3, rolled: boolean): TipPose {
  const z = forward.clone().normalize();
  const x = beam.clone().addScaledVector(z, -beam.dot(z)).normalize();
  const y = new Vector3().crossVectors(z, x);
  return { matrix: new Matrix4().makeBasis(x, y, z).setPosition(60, 5, -8), valid: true, beam: rolled };
}

const column = (matrix: Matrix4, index: number): number[] => new Vector3().setFromMatrixColumn(matrix, index).toArray();
const expectNear = (found: number[], wanted: number[]): void => found.forEach((value, i) => expect(value).toBeCloseTo(wanted[i]!, 6));

describe("the view from the tip", () => {
  it("stands at the tip, looks along it, and has the beam up where the roll is known", () => {
    const out = new Matrix4();
    new Upright().update(tipAt(new Vector3(1, 0, 0), new Vector3(0, -1, 0), true), 0.01, out);
    expectNear(column(out, 2), [-1, 0, 0]); // three's cameras look along -z
    expectNear(column(out, 1), [0, -1, 0]);
    expectNear(column(out, 3), [60, 5, -8]);
    expect(out.determinant()).toBeCloseTo(1, 9);
  });

  it("keeps the box's up up where it is not, and does not turn over when the tip swings through the vertical", () => {
    const upright = new Upright();
    const out = new Matrix4();
    let before: Vector3 | null = null;
    for (let turn = 0; turn <= 180; turn += 1) {
      const angle = (turn * Math.PI) / 180;
      upright.update(tipAt(new Vector3(Math.cos(angle), 0.02, Math.sin(angle)), new Vector3(0, -1, 0), false), 1 / 60, out);
      const up = new Vector3().setFromMatrixColumn(out, 1);
      if (turn === 0) expect(up.z).toBeGreaterThan(0.99);
      if (before !== null) expect(up.angleTo(before)).toBeLessThan(0.2);
      expect(out.determinant()).toBeCloseTo(1, 6);
      before = up;
    }
  });
});

describe("relativeDensities", () => {
  it("weighs the parts as the heart's file says, and all alike where it says nothing", () => {
    const parts = (...opacities: (number | null)[]): { description: { opacity: number | null } }[] => opacities.map((opacity) => ({ description: { opacity } }));
    expect(relativeDensities(parts(0.25, 0.75))).toEqual([0.5, 1.5]);
    expect(relativeDensities(parts(null, null))).toEqual([1, 1]);
    expect(relativeDensities(parts(0.4, null, 0.4))).toEqual([1, 1, 1]);
  });
});
