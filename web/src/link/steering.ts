/** Sends what the sliders say: newest wins, one command on its way at a time, so that a slow link never queues. */

import type { Answer } from "./commands";

export type Control = "insertion_mm" | "roll_deg" | "anterior_deg" | "left_deg";
export const CONTROLS: readonly Control[] = ["insertion_mm", "roll_deg", "anterior_deg", "left_deg"];

/** The shortest time between two commands. */
export const STEER_EVERY_MS = 30;

export class Steering {
  private pending: Partial<Record<Control, number>> = {};
  private busy = false;

  /**
   * `ask` sends a command; `onRefused` gets the sentence of a refusal. Only what was moved is sent: the rest of the
   * catheter is left to whatever else moves it.
   */
  constructor(
    private readonly ask: (name: string, args: Record<string, unknown>) => Promise<Answer>,
    private readonly onRefused: (sentence: string) => void,
  ) {}

  set(control: Control, value: number): void {
    this.pending[control] = value;
    if (!this.busy) void this.flush();
  }

  private async flush(): Promise<void> {
    this.busy = true;
    while (Object.keys(this.pending).length > 0) {
      const args = this.pending;
      this.pending = {};
      const [answer] = await Promise.all([this.ask("steer", args), pause(STEER_EVERY_MS)]);
      if (!answer.done) {
        this.pending = {};
        this.onRefused(answer.sentence);
      }
    }
    this.busy = false;
  }
}

function pause(ms: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
