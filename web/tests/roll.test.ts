import { describe, expect, it } from "vitest";
import type { RollState, TrackMessage } from "../src/generated/messages";
import { rollView } from "../src/ui/roll";

const VALID: RollState = { type: "roll", present: true, valid: true, needs: "", sentence: "", predicted: false };
const RESTARTED: RollState = {
  ...VALID, valid: false, needs: "confirm", sentence: "The encoder restarted and kept its count: confirm that roll is right.",
};
const POWER: RollState = { ...RESTARTED, needs: "jig", sentence: "The encoder's count was lost: set roll zero with the jig." };
const TRACK: TrackMessage = {
  type: "track", seq: 7, t: 1, status: "tracked", reason: "",
  points: [[10, 0, 0], [0, 0, 0]], tip: { position: [10, 0, 0], orientation_wxyz: [1, 0, 0, 0] },
  roll: 0.5, roll_predicted: false, yaw: 0, pitch: 0, sigma_mm: 0.1, latency_ms: 20,
};
const WITHOUT: TrackMessage = { ...TRACK, roll: null };

describe("rollView", () => {
  it("shows a beam with a valid roll and says nothing else", () => {
    expect(rollView(VALID, TRACK, true)).toEqual({
      legend: "beam direction (roll)", beam: true, detail: "", action: null, hint: "",
    });
  });

  it("says why roll is not valid, and gives an operator the button for it", () => {
    const confirm = rollView(RESTARTED, WITHOUT, true);
    expect(confirm.beam).toBe(false);
    expect(confirm.detail).toBe("Roll not valid: the encoder restarted and kept its count: confirm that roll is right.");
    expect(confirm.action).toEqual({ command: "roll_confirm", label: "Confirm roll" });
    const jig = rollView(POWER, WITHOUT, true);
    expect(jig.action).toEqual({ command: "roll_zero", label: "Roll zero set with the jig" });
    expect(jig.hint).toContain("mark T");
  });

  it("gives a viewer the reason but no button", () => {
    const view = rollView(RESTARTED, WITHOUT, false);
    expect(view.detail).not.toBe("");
    expect(view.action).toBeNull();
    expect(view.hint).toBe("An operator can do this.");
  });

  it("offers nothing where nobody can do anything here", () => {
    const view = rollView({ ...RESTARTED, present: false, needs: "", sentence: "The roll encoder has gone." }, WITHOUT, true);
    expect(view.action).toBeNull();
    expect(view.hint).toBe("");
    expect(view.legend).toBe("roll not valid");
  });

  it("draws no beam for a Track without roll, whatever else is said", () => {
    expect(rollView(VALID, WITHOUT, true).beam).toBe(false);
    expect(rollView(null, WITHOUT, true)).toMatchObject({ legend: "roll not known", beam: false, detail: "" });
    const none: RollState = { ...VALID, present: false, valid: false };
    expect(rollView(none, WITHOUT, true)).toMatchObject({ legend: "no roll encoder", beam: false, detail: "" });
  });

  it("shows the beam of a replay, which has no state of the roll", () => {
    expect(rollView(null, TRACK, false)).toMatchObject({ beam: true, detail: "" });
  });

  it("does not call an old Track's beam valid once the state says otherwise", () => {
    expect(rollView(RESTARTED, TRACK, true).beam).toBe(false);
  });
});
