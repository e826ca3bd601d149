/** The side's end: what the segmentation does, what to do next. */

import type { HeartSeedsState } from "../generated/messages";
import { sentence, withUnits } from "../maths/format";
import { byId, setText } from "../ui/dom";

export function showAct(state: HeartSeedsState | null, live: boolean): void {
  const running = state?.stage === "segmenting";
  const advice = byId("advice");
  byId("doing").hidden = !running;
  if (running) {
    setText(byId("doing-what"), state.doing);
    setText(byId("doing-share"), state.progress === null ? "" : `${Math.floor(state.progress * 100)} %`);
    const bar = byId<HTMLProgressElement>("doing-bar");
    if (state.progress === null) bar.removeAttribute("value");
    else bar.value = state.progress;
  }
  advice.dataset["level"] = state?.stage === "failed" ? "bad" : "";
  setText(advice, state === null ? (live ? "The server places no seeds." : "Waiting for the server.") : withUnits(sentence(state.advice)));
}

/** Returns what to say about a scan whose slices run at an angle to the patient; empty: they hardly do. */
export function tiltText(state: HeartSeedsState): string {
  return state.tilt_deg < 5 ? "" : `oblique: ${Math.round(state.tilt_deg)}° to the patient's axes`;
}
