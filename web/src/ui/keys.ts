/** Keys: single strokes for actions, held keys for steering. */

import type { Control } from "../link/steering";

/** Each steering key's control and speed, in the control's unit a second. */
const HELD: Record<string, readonly [Control, number]> = {
  w: ["insertion_mm", 30],
  s: ["insertion_mm", -30],
  d: ["roll_deg", 100],
  a: ["roll_deg", -100],
  arrowup: ["anterior_deg", 60],
  arrowdown: ["anterior_deg", -60],
  arrowleft: ["left_deg", 60],
  arrowright: ["left_deg", -60],
};
const FINE = 0.25;
const LONGEST_FRAME_S = 0.1;

export interface KeyHandlers {
  /** A steering key is held: move a control by this amount. */
  onNudge(control: Control, amount: number): void;
  /** Any other key; returns whether it meant something. */
  onStroke(key: string): boolean;
}

export class Keys {
  private readonly held = new Set<string>();
  private fine = false;
  private lastMs = 0;
  /** Whether steering keys do anything now. */
  steering = false;

  constructor(private readonly handlers: KeyHandlers) {
    addEventListener("keydown", (event) => this.down(event));
    addEventListener("keyup", (event) => this.held.delete(event.key.toLowerCase()));
    addEventListener("blur", () => this.held.clear());
  }

  /** Moves what held keys move. Called once for each frame. */
  update(nowMs: number): void {
    const seconds = Math.min(LONGEST_FRAME_S, (nowMs - this.lastMs) / 1000);
    this.lastMs = nowMs;
    if (this.held.size === 0) return;
    if (!this.steering) {
      this.held.clear();
      return;
    }
    for (const key of this.held) {
      const [control, speed] = HELD[key]!;
      this.handlers.onNudge(control, speed * seconds * (this.fine ? FINE : 1));
    }
  }

  private down(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]") !== null) return;
    const key = event.key.toLowerCase();
    this.fine = event.shiftKey;
    const target = event.target as HTMLElement;
    if (takesText(target) || (key.startsWith("arrow") && takesArrows(target))) return;
    if ((key === " " || key === "enter") && target.closest("button, select, input, summary") !== null) return;
    if (key in HELD) {
      if (this.steering) {
        this.held.add(key);
        event.preventDefault();
      }
    } else if (!event.repeat && this.handlers.onStroke(event.key)) {
      event.preventDefault();
    }
  }
}

function takesText(target: HTMLElement): boolean {
  if (target instanceof HTMLInputElement) return !["range", "checkbox", "button"].includes(target.type);
  return target instanceof HTMLTextAreaElement || target.isContentEditable;
}

function takesArrows(target: HTMLElement): boolean {
  return target instanceof HTMLInputElement || target instanceof HTMLSelectElement || target.getAttribute("role") === "tab";
}
