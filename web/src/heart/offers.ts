/** Which buttons the page offers now, and why one of them cannot be pressed. */

import type { Offer } from "../calibrate/buttons";
import type { HeartSeedsState } from "../generated/messages";

/** Returns the offers for a state, the most important first. `viewing`: why this page may not command, or empty. */
export function offersFor(state: HeartSeedsState, viewing: string): Offer[] {
  const running = state.stage === "segmenting";
  const first = running ? "" : !state.is_current ? "seeds_segment" : !state.saved ? "seeds_save" : state.seeds.length > 0 ? "seeds_done" : "";
  const offers: Offer[] = [
    running
      ? offer("seeds_stop", "Stop")
      : offer("seeds_segment", state.labels_from === "nothing" ? "Segment" : "Segment again"),
    ...(state.saved ? [] : [offer("seeds_save", "Save seeds")]),
    offer("seeds_done", "Done", state.saved ? "" : "The seeds have changed since they were saved: these changes would be lost."),
  ];
  const ranked = offers.map((each) => ({ ...each, kind: each.command === first ? "primary" as const : each.kind }));
  ranked.sort((a, b) => Number(b.kind === "primary") - Number(a.kind === "primary"));
  return viewing === "" ? ranked : ranked.map((each) => ({ ...each, why: viewing }));
}

function offer(command: string, label: string, confirm = ""): Offer {
  return { command, label, kind: "plain", why: "", confirm };
}
