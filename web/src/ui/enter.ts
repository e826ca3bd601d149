/** The buttons that enter VR and AR, and leave them; pressed where that cannot be, they say why. */

import type { XrMode, XrSessions, XrState } from "../xr/sessions";
import { byId } from "./dom";

const NAMES: Record<XrMode, string> = { vr: "VR", ar: "AR" };
const MODES = ["vr", "ar"] as const;
const WHAT: Record<XrMode, string> = { vr: "The heart around you", ar: "The heart in your room" };

export interface EnterHandlers {
  /** A person has pressed a button that cannot do anything here. */
  onReason(sentence: string): void;
  /** A session has begun, or ended (null). */
  onMode(mode: XrMode | null): void;
}

export class EnterButtons {
  private readonly buttons: Record<XrMode, HTMLButtonElement> = {
    vr: byId<HTMLButtonElement>("enter-vr"),
    ar: byId<HTMLButtonElement>("enter-ar"),
  };
  private mode: XrMode | null = null;

  constructor(
    private readonly sessions: Pick<XrSessions, "enter" | "leave" | "whyNot" | "onChange" | "state">,
    private readonly handlers: EnterHandlers,
  ) {
    for (const mode of MODES) this.buttons[mode].addEventListener("click", () => void this.press(mode));
    sessions.onChange = (state) => this.show(state);
    this.show(sessions.state);
  }

  private show({ mode, phase }: XrState): void {
    const running = phase === "none" || phase === "starting" ? null : mode;
    for (const each of MODES) {
      const button = this.buttons[each];
      const reason = this.sessions.whyNot(each);
      const now = running === each;
      button.textContent = `${now ? "Leave" : "Enter"} ${NAMES[each]}`;
      // Not `disabled`: a press says why, where a touch screen shows no title.
      button.setAttribute("aria-disabled", String((reason !== null && !now) || phase === "starting"));
      button.title = now ? "Back to this page" : reason ?? WHAT[each];
    }
    if (running !== this.mode) {
      this.mode = running;
      this.handlers.onMode(running);
    }
  }

  private async press(mode: XrMode): Promise<void> {
    if (this.sessions.state.phase === "starting") return;
    if (this.mode === mode) {
      this.sessions.leave();
      return;
    }
    const reason = this.sessions.whyNot(mode);
    if (reason !== null) {
      this.handlers.onReason(reason);
      return;
    }
    try {
      await this.sessions.enter(mode);
    } catch (error) {
      this.handlers.onReason(error instanceof Error ? error.message : String(error));
    }
  }
}
