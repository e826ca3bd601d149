/** What the page tells a person who holds the board, from one state to the next. */

import type { IntrinsicsState } from "../generated/messages";

export type Look = "searching" | "known" | "hold" | "capturing" | "captured" | "solving" | "done" | "failed";

/** How long "captured" stays, ms: long enough to be seen from two metres. */
export const CAPTURED_MS = 1100;

const WORDS: Record<Look, string> = {
  searching: "Looking for the board",
  known: "Seen already: move on",
  hold: "Hold still",
  capturing: "Good, keep still",
  captured: "Captured",
  solving: "Calculating",
  done: "Calculated",
  failed: "Not yet",
};

/** Returns the look's words. */
export function lookWords(look: Look): string {
  return WORDS[look];
}

/** Returns the one thing to show, `sinceCaptureMs` after the last view was kept. */
export function lookOf(state: IntrinsicsState, sinceCaptureMs: number): Look {
  if (state.stage !== "collecting") return state.stage;
  if (sinceCaptureMs < CAPTURED_MS) return "captured";
  if (state.corners_px.length === 0) return "searching";
  if (!state.is_new) return "known";
  return state.is_still ? "capturing" : "hold";
}

/** Notices that a view was kept: the count grows from one state to the next of the same camera and link. */
export class CaptureWatch {
  private camera = "";
  private kept: number | null = null;
  private atMs = -Infinity;

  /** Takes a state; returns whether a view was kept since the one before. */
  take(state: IntrinsicsState, nowMs: number): boolean {
    const grown = this.kept !== null && this.camera === state.camera && state.kept > this.kept;
    this.camera = state.camera;
    this.kept = state.kept;
    if (grown) this.atMs = nowMs;
    return grown;
  }

  since(nowMs: number): number {
    return nowMs - this.atMs;
  }

  /** Another link: what grew meanwhile was not captured before the person's eyes. */
  forget(): void {
    this.kept = null;
    this.atMs = -Infinity;
  }
}
