import { Matrix4, Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { SteadyPose } from "../src/ice/steady";
import { ARRAY_BEHIND_TIP_MM, tipFromTransducer } from "../src/ice/transducer";

const pose = (position: Vector3, rollRad = 0): Matrix4 =>
  new Matrix4().compose(position, new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), rollRad), new Vector3(1, 1, 1));

/** Numbers of a normal distribution, the same in every run. */
function makeNoise(seed: number): () => number {
  let state = seed;
  const uniform = (): number => {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    return (state + 0.5) / 4294967296;
  };
  return () => Math.sqrt(-2 * Math.log(uniform())) * Math.cos(2 * Math.PI * uniform());
}

const offMm = (a: Matrix4, b: Matrix4): number =>
  new Vector3().setFromMatrixPosition(a).distanceTo(new Vector3().setFromMatrixPosition(b));

describe("transducer", () => {
  it("is on the catheter's side, behind the tip, with the tip's axes", () => {
    const matrix = tipFromTransducer(1.5);
    expect(new Vector3().setFromMatrixPosition(matrix).toArray()).toEqual([1.5, 0, -ARRAY_BEHIND_TIP_MM]);
    expect(new Vector3().setFromMatrixColumn(matrix, 0).toArray()).toEqual([1, 0, 0]);
  });
});

describe("steady pose", () => {
  it("takes the first pose as it is", () => {
    const steady = new SteadyPose();
    const wanted = pose(new Vector3(40, 1, 2), 0.3);
    expect(steady.follow(wanted, 0.016)).toBe(true);
    expect(offMm(steady.matrix, wanted)).toBe(0);
    expect(steady.follow(wanted, 0.016)).toBe(false);
  });

  it("comes to rest under the noise of a tip at rest", () => {
    const noise = makeNoise(5);
    const steady = new SteadyPose();
    let moved = 0;
    let way = 0;
    const last = new Matrix4();
    for (let frame = 0; frame < 900; frame++) {
      // what is left after the motion's own smoothing: 0.02 mm, 0.05 degrees
      const wanted = pose(new Vector3(40 + 0.01 * noise(), 0.01 * noise(), 0.01 * noise()), 0.0009 * noise());
      last.copy(steady.matrix);
      if (steady.follow(wanted, 1 / 90) && frame > 90) {
        moved += 1;
        way += offMm(steady.matrix, last);
      }
    }
    expect(way / 810).toBeLessThan(0.0005); // mm a frame: a sample of the picture is 0.2 mm
    expect(moved).toBeLessThan(300);
  });

  it("is nowhere further behind than the noise is wide, however fast it goes", () => {
    const steady = new SteadyPose();
    for (const speed of [1, 20, 200]) {
      for (let frame = 0; frame < 90; frame++) {
        const wanted = pose(new Vector3((speed * frame) / 90, 0, 0), 0.02 * frame);
        steady.follow(wanted, 1 / 90);
        expect(offMm(steady.matrix, wanted)).toBeLessThan(0.061);
        const off = new Quaternion().setFromRotationMatrix(steady.matrix).angleTo(new Quaternion().setFromRotationMatrix(wanted));
        expect(off).toBeLessThan(0.0041); // 0.23 degrees
      }
    }
  });

  it("arrives, and stops", () => {
    const steady = new SteadyPose();
    steady.follow(pose(new Vector3(0, 0, 0)), 1 / 90);
    const wanted = pose(new Vector3(0.5, 0, 0));
    for (let frame = 0; frame < 900; frame++) steady.follow(wanted, 1 / 90);
    expect(offMm(steady.matrix, wanted)).toBeLessThan(0.04);
    expect(steady.follow(wanted, 1 / 90)).toBe(false);
  });
});
