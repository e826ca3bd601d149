/** Roll being measured in the jig: the steps, a dial that turns with the handle, the range of the rocking. */

import type { RollCalibrationState } from "../generated/messages";
import { byId, make, setText } from "../ui/dom";
import { keyed } from "./keyed";
import { arcPath, degrees, gearPath, rocked } from "./roll_dial";
import type { Call, View } from "./view";

const STEPS: Record<RollCalibrationState["step"], string> = {
  zero: "Into the jig", backlash: "Rock", turn: "One turn", review: "Save",
};

export class RollView implements View<RollCalibrationState> {
  private readonly area = byId("roll");
  private readonly dial = byId<HTMLElement & SVGElement>("roll-dial");
  private readonly gear = byId("roll-gear");

  constructor() {
    byId("roll-teeth").setAttribute("d", gearPath(66, 73));
  }

  title(state: RollCalibrationState): string {
    return state.is_simulated ? "Roll, in the jig: simulation" : "Roll, in the jig";
  }

  take(state: RollCalibrationState): void {
    this.area.hidden = false;
    this.area.dataset["step"] = state.step;
    this.showSteps(state);
    this.showDial(state);
    this.showRocking(state);
    const { count, rate_hz: rate } = state;
    setText(byId("roll-count"), count === null ? "–" : String(count).replace("-", "−"));
    setText(byId("roll-rate"), rate === null ? "–" : `${rate.toFixed(0)} Hz`);
    setText(byId("roll-rest"), !state.connected ? "no encoder" : state.is_still ? "still" : "moving");
    byId("roll-rest").dataset["level"] = !state.connected ? "bad" : state.is_still ? "good" : "warn";
    const valid = byId("roll-valid");
    setText(valid, state.is_valid ? "set and confirmed" : "not yet set");
    valid.dataset["level"] = state.is_valid ? "good" : "warn";
  }

  call(state: RollCalibrationState): Call {
    if (state.stage === "failed") return { look: "failed", word: "Begin again" };
    if (state.stage === "solving") return { look: "solving", word: "Saving" };
    if (state.stage === "done") return state.writes === "" ? { look: "done", word: "Measured" } : { look: "wanted", word: "The rig says otherwise" };
    if (!state.connected) return { look: "searching", word: "Encoder" };
    return { look: state.can_confirm ? "known" : "wanted", word: STEPS[state.step] };
  }

  allow(): void {
    // nothing here can be pressed
  }

  tick(): void {
    // states come often enough
  }

  hide(): void {
    this.area.hidden = true;
  }

  shown(): Record<string, number> {
    return {};
  }

  private showSteps(state: RollCalibrationState): void {
    const now = state.steps.indexOf(state.step);
    keyed(byId("roll-steps"), state.steps, (step) => step, () => make("li"), (item, step) => {
      const index = state.steps.indexOf(step);
      setText(item, STEPS[step]);
      item.dataset["is"] = index < now ? "past" : index === now ? "now" : "next";
      if (index === now) item.setAttribute("aria-current", "step");
      else item.removeAttribute("aria-current");
    });
  }

  private showDial(state: RollCalibrationState): void {
    const zero = degrees(state.zero_rad);
    const turned = state.turned_rad ?? 0;
    const known = state.step !== "zero";
    byId("roll-zero").setAttribute("transform", `rotate(${zero.toFixed(2)})`);
    this.gear.setAttribute("transform", `rotate(${(zero + degrees(turned)).toFixed(2)})`);
    this.gear.dataset["known"] = String(known);
    byId("roll-arc").setAttribute("d", known && state.step !== "backlash" ? arcPath(state.zero_rad, turned, 84) : "");
    const text = state.turned_rad === null ? "–" : known ? angleText(turned) : "T ?";
    setText(byId("roll-angle"), text);
    this.dial.setAttribute("aria-label", `Turned by ${text}, seen from the handle`);
  }

  private showRocking(state: RollCalibrationState): void {
    const bar = byId("roll-rocking");
    const seen = rocked(state);
    bar.hidden = seen === null;
    if (seen === null || state.rocking === null) return;
    const { stops, wanted } = state.rocking;
    const enough = stops >= wanted;
    bar.dataset["level"] = seen.wide ? "bad" : enough ? "good" : "plain";
    byId("roll-slider").style.left = `${(100 * seen.share).toFixed(1)}%`;
    setText(byId("roll-width"), `${seen.widthDeg.toFixed(2)}°`);
    setText(byId("roll-stops"), `${Math.min(stops, wanted)} of ${wanted} stops on each side`);
  }
}

function angleText(rad: number): string {
  const value = degrees(rad);
  return `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(Math.abs(value) < 100 ? 2 : 1)}°`;
}
