import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { boxFromGltf } from "../src/scene/heart";
import { FrameBudget } from "../src/scene/budget";

describe("boxFromGltf", () => {
  it("undoes ct_from_box with its scale, and glTF's axes and metres", () => {
    const angle = 0.7;
    const half = angle / 2;
    const registration = {
      kind: "similarity", fre_mm: null, tre_mm: null, scale: 1.25,
      ct_from_box: {
        rotation_wxyz: [Math.cos(half), 0, 0, Math.sin(half)] as [number, number, number, number],
        translation_mm: [10, -20, 30] as [number, number, number],
      },
    };
    const box = new Vector3(41, -7, 12);
    // point_ct = scale R point_box + t, with R a turn about z
    const ct = [
      1.25 * (Math.cos(angle) * box.x - Math.sin(angle) * box.y) + 10,
      1.25 * (Math.sin(angle) * box.x + Math.cos(angle) * box.y) - 20,
      1.25 * box.z + 30,
    ] as const;
    const gltf = new Vector3(ct[0], ct[2], -ct[1]).divideScalar(1000);
    const back = gltf.applyMatrix4(boxFromGltf(new Matrix4(), registration));
    expect(back.distanceTo(box)).toBeLessThan(1e-9);
  });
});

describe("FrameBudget", () => {
  it("lowers the resolution after slow frames, never below its floor, and not for pauses", () => {
    const budget = new FrameBudget(2, true);
    let now = 0;
    for (let i = 0; i < 20; i++) expect(budget.frame((now += 5000))).toBe(false);
    for (let i = 0; i < 500; i++) budget.frame((now += 60));
    expect(budget.pixelRatio).toBeCloseTo(0.6, 9);
    const fixed = new FrameBudget(2, false);
    for (let i = 0; i < 500; i++) fixed.frame((now += 60));
    expect(fixed.pixelRatio).toBe(2);
  });
});
