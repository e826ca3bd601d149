/** Whether the roll can be trusted: the legend of the beam, why it is not valid, and the button that puts it right. */

import type { RollState, TrackMessage } from "../generated/messages";
import type { Commands } from "../link/commands";
import { byId, setText } from "./dom";
import { toast } from "./toasts";

export interface RollView {
  /** What the legend says, and whether a beam is drawn. */
  readonly legend: string;
  readonly beam: boolean;
  /** Why there is no valid roll, with what to do; empty when there is nothing to say. */
  readonly detail: string;
  /** The command that puts it right and what its button says; null where a person can or may do nothing here. */
  readonly action: { readonly command: "roll_confirm" | "roll_zero"; readonly label: string } | null;
  readonly hint: string;
}

const JIG_HINT =
  "Slide the transducer to the jig at the far end, turn the gear's mark T to the right side and hold it there.";

/** Returns what to show. state: null when the server has said nothing of the roll. */
export function rollView(state: RollState | null, track: TrackMessage | null, operating: boolean): RollView {
  const beam = track !== null && track.roll !== null;
  const invalid = state !== null && !state.valid && state.sentence !== "";
  if (!invalid) {
    const absent = state !== null && !state.present ? "no roll encoder" : "roll not known";
    const waiting = track === null || track.points === null;
    return { legend: beam || waiting ? "beam direction (roll)" : absent, beam: beam || waiting, detail: "", action: null, hint: "" };
  }
  const action =
    state.needs === "confirm" ? ({ command: "roll_confirm", label: "Confirm roll" } as const)
    : state.needs === "jig" ? ({ command: "roll_zero", label: "Roll zero set with the jig" } as const)
    : null;
  return {
    legend: "roll not valid",
    beam: false,
    detail: `Roll not valid: ${state.sentence.charAt(0).toLowerCase()}${state.sentence.slice(1)}`,
    action: operating ? action : null,
    hint: action === null ? "" : !operating ? "An operator can do this." : state.needs === "jig" ? JIG_HINT : "",
  };
}

export class RollPanel {
  private readonly legend = byId("legend");
  private readonly note = byId("roll-note");
  private readonly button = byId<HTMLButtonElement>("roll-action");
  private state: RollState | null = null;
  private shown: RollView | null = null;
  /** Told when there is something else to say or to do. */
  onChange: () => void = () => undefined;
  private busy = false;

  constructor(private readonly commands: Commands) {
    this.button.addEventListener("click", () => void this.act());
  }

  get view(): RollView | null {
    return this.shown;
  }

  take(state: RollState): void {
    this.state = state;
  }

  /** The link is gone: what was said of the roll is no longer so. */
  leave(): void {
    this.state = null;
  }

  /** Shows how the roll stands. `operating`: whether this page may command. */
  show(track: TrackMessage | null, operating: boolean): void {
    const view = rollView(this.state, track, operating);
    const changed = this.shown?.detail !== view.detail || this.shown.action?.command !== view.action?.command;
    this.shown = view;
    if (changed) this.onChange();
    this.legend.dataset["beam"] = String(view.beam);
    setText(byId("legend-text"), view.legend);
    byId("roll").dataset["invalid"] = String(view.detail !== "");
    this.note.hidden = view.detail === "";
    setText(byId("roll-detail"), view.detail);
    setText(byId("roll-hint"), view.hint);
    this.button.hidden = view.action === null;
    this.button.disabled = this.busy;
    if (view.action !== null) setText(this.button, view.action.label);
  }

  /** Puts the roll right, as the button does. */
  async act(): Promise<void> {
    const action = this.shown?.action;
    if (!action || this.busy) return;
    this.busy = this.button.disabled = true;
    const answer = await this.commands.ask(action.command);
    this.busy = false;
    if (!answer.done) toast(answer.sentence, "bad");
  }
}
