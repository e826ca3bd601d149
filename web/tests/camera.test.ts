import { describe, expect, it } from "vitest";
import type { CameraDescription } from "../src/generated/messages";
import { CameraModel } from "../src/maths/camera";
import cases from "./fixtures/projection.json";

describe("CameraModel", () => {
  for (const each of cases) {
    it(`projects as OpenCV does, distortion: ${each.camera.name}`, () => {
      const model = new CameraModel(each.camera as unknown as CameraDescription);
      const out = new Float64Array(2);
      each.points.forEach((point, i) => {
        expect(model.projectInto(out, 0, point[0]!, point[1]!, point[2]!)).toBe(true);
        // Both are double precision: only the order of operations differs.
        expect(out[0]).toBeCloseTo(each.pixels[i]![0]!, 8);
        expect(out[1]).toBeCloseTo(each.pixels[i]![1]!, 8);
      });
    });
  }

  it("refuses a point behind the camera and leaves the output alone", () => {
    const camera = cases[1]!.camera as unknown as CameraDescription;
    const behind = { ...camera, camera_from_box: { rotation_wxyz: [1, 0, 0, 0], translation_mm: [0, 0, -10] } } as CameraDescription;
    const out = new Float64Array([7, 8]);
    expect(new CameraModel(behind).projectInto(out, 0, 0, 0, 5)).toBe(false);
    expect([...out]).toEqual([7, 8]);
  });
});
