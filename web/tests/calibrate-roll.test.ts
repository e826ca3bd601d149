import { describe, expect, it } from "vitest";
import { offersFor } from "../src/calibrate/buttons";
import { arcPath, at, gearPath, rocked } from "../src/calibrate/roll_dial";
import type { RollCalibrationState } from "../src/generated/messages";

const ROLL: RollCalibrationState = {
  type: "calibrate_roll", stage: "collecting", step: "zero", steps: ["zero", "backlash", "turn", "review"], advice: "Slide it in.",
  is_simulated: false, connected: true, count: 12, turned_rad: 0, zero_rad: 0, rate_hz: 200, is_still: true, is_valid: false, rocking: null,
  can_confirm: true, why: "", writes: "", can_save: false, figures: [],
};
const ROCKING = { low_rad: -0.004, high_rad: 0.004, limit_rad: 0.05, stops: 2, wanted: 4 };

describe("the dial", () => {
  it("goes clockwise from the right, as seen from the handle", () => {
    expect(at(0, 10)).toEqual({ x: 10, y: 0 });
    expect(at(Math.PI / 2, 10).y).toBeCloseTo(10); // y is downwards
    expect(arcPath(0, Math.PI / 2, 10)).toBe("M10.00 0.00A10 10 0 0 1 0.00 10.00");
    expect(arcPath(0, -Math.PI / 2, 10)).toBe("M10.00 0.00A10 10 0 0 0 0.00 -10.00");
    expect(arcPath(0, 1.5 * Math.PI, 10)).toContain("0 1 1");
  });

  it("stays one arc for a whole turn and beyond: an arc that ends where it begins is not drawn", () => {
    const whole = arcPath(0, 2 * Math.PI, 84);
    expect(whole.split(" ").at(-1)).not.toBe("0.00");
    expect(arcPath(0, 9, 84)).toBe(whole);
  });

  it("draws every tooth", () => {
    expect(gearPath(66, 73).split("L")).toHaveLength(48 * 5);
  });
});

describe("the rocking range", () => {
  it("places the gear between its stops and tells when it goes too far", () => {
    expect(rocked(ROLL)).toBeNull();
    const state = { ...ROLL, step: "backlash", rocking: ROCKING, turned_rad: -0.004 } as const;
    expect(rocked(state)).toMatchObject({ share: 0, wide: false });
    expect(rocked({ ...state, turned_rad: 0.004 })!.share).toBe(1);
    expect(rocked({ ...state, turned_rad: 0 })!.widthDeg).toBeCloseTo(0.458, 3);
    expect(rocked({ ...state, rocking: { ...ROCKING, high_rad: 0.2 } })!.wide).toBe(true);
    expect(rocked({ ...state, rocking: { ...ROCKING, low_rad: 0, high_rad: 0 } })!.share).toBe(0.5);
  });
});

describe("what may be done", () => {
  const words = (state: RollCalibrationState) => offersFor(state, "").map(({ command, label, why }) => [command, label, why]);

  it("confirms step by step, with the reason where it cannot", () => {
    expect(words(ROLL)).toEqual([
      ["calibration_confirm", "T is in the jig, locked", ""], ["calibration_cancel", "Cancel", ""],
    ]);
    const moving = { ...ROLL, step: "turn", can_confirm: false, why: "The handle is moving." } as const;
    expect(words(moving)[0]).toEqual(["calibration_confirm", "One turn done, locked", "The handle is moving."]);
    expect(words(moving)[1]![0]).toBe("calibration_repeat");
  });

  it("says on the button what is written into the rig, and saves nothing while the handle moves", () => {
    const done = { ...ROLL, stage: "done", step: "review", can_save: true } as const;
    expect(words(done)[0]).toEqual(["calibration_accept", "Save zero and backlash", ""]);
    expect(words({ ...done, writes: "gear_ratio 2.0" })[0]![1]).toBe("Write gear_ratio 2.0 and save");
    expect(words({ ...done, is_still: false })[0]![2]).toContain("moving");
    expect(words({ ...done, stage: "solving" })).toEqual([["calibration_cancel", "Cancel", ""]]);
    expect(words({ ...done, stage: "failed" })[0]).toEqual(["calibration_repeat", "Begin again", ""]);
  });

  it("asks before what was measured is thrown away, and offers a viewer nothing", () => {
    expect(offersFor({ ...ROLL, step: "turn" }, "").at(-1)!.confirm).toContain("lost");
    expect(offersFor(ROLL, "").at(-1)!.confirm).toBe("");
    expect(offersFor(ROLL, "Viewing only.").every((each) => each.why === "Viewing only.")).toBe(true);
  });
});
