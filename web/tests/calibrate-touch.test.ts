import { describe, expect, it } from "vitest";
import { offersFor } from "../src/calibrate/buttons";
import { spotsOf, wordsOf } from "../src/calibrate/touch_view";
import type { TouchState, TouchedLandmark } from "../src/generated/messages";

const WAITING: TouchedLandmark = {
  name: "apex", label: "Apex", status: "waiting", places: [[0.25, 0.5], [0.75, 0.5]], spread_mm: null, residual_mm: null, held_out_mm: null,
};
const TOUCHED: TouchedLandmark = { ...WAITING, name: "cava", label: "Vena cava", status: "touched", spread_mm: 0.12 };
const STATE: TouchState = {
  type: "calibrate_registration", stage: "collecting", advice: "Touch it.", is_simulated: false, kind: "rigid",
  landmarks: [WAITING, TOUCHED], current: "apex", views: [], tip_places: [], is_tracked: true, trouble: "", rest_share: 1,
  rest_spread_mm: 0.1, can_take: true, why: "", can_finish: false, can_save: false, doubts: [], is_grave: false, figures: [], pictures: [],
};

function commands(state: TouchState): string[] {
  return offersFor(state, "").map((each) => each.command);
}

describe("touching landmarks", () => {
  it("shows where to touch, over what was touched, and the tip over all", () => {
    const spots = spotsOf({ ...STATE, tip_places: [[0.1, 0.2], [0.3, 0.4]] }, 1);
    expect(spots.map((each) => [each.key, each.x, each.look])).toEqual([["cava", 75, "touched"], ["apex", 75, "now"], [" tip", 30, "tip"]]);
    expect(spotsOf({ ...STATE, current: null }, 0).map((each) => each.look)).toEqual(["waiting", "touched"]);
  });

  it("says of each landmark the error that counts, and not what the fit left", () => {
    expect(wordsOf(WAITING)).toBe("");
    expect(wordsOf(TOUCHED)).toBe("touched, ±0.12 mm");
    expect(wordsOf({ ...TOUCHED, residual_mm: 0.2, held_out_mm: 1.44 })).toBe("held out 1.4 mm");
    expect(wordsOf({ ...TOUCHED, status: "skipped" })).toBe("skipped");
  });

  it("offers what may be done, and says why not", () => {
    expect(commands(STATE)).toEqual(["registration_take", "registration_skip", "calibration_cancel"]);
    expect(commands({ ...STATE, can_finish: true })).toContain("calibration_finish");
    expect(commands({ ...STATE, current: null, can_finish: true })[0]).toBe("calibration_finish");
    const moving = offersFor({ ...STATE, can_take: false, why: "Hold it still." }, "")[0]!;
    expect(moving.why).toBe("Hold it still.");
    expect(offersFor(STATE, "Viewing only.").every((each) => each.why === "Viewing only.")).toBe(true);
  });

  it("puts going back first where the result is in doubt", () => {
    const done: TouchState = { ...STATE, stage: "done", can_save: true };
    expect(commands(done)[0]).toBe("calibration_accept");
    const doubted = offersFor({ ...done, is_grave: true, doubts: ["a and b look swapped."] }, "");
    expect(doubted.map((each) => [each.command, each.kind]).slice(0, 2)).toEqual([["calibration_continue", "primary"], ["calibration_accept", "plain"]]);
    expect(doubted[1]!.label).toBe("Save in spite of doubts");
  });
});
