/** What each kind of calibration gives the page. */

import type { Answer } from "../link/commands";

/** What is said in large letters, and how it is coloured. */
export interface Call {
  readonly look: string;
  readonly word: string;
}

export interface View<State> {
  /** The page's heading. */
  title(state: State): string;
  /** Shows a state. */
  take(state: State): void;
  call(state: State): Call;
  /** Says whether this page may command, and whether pictures can be asked for. */
  allow(operating: boolean, linked: boolean): void;
  /** Called while the view is shown, ten times a second. */
  tick(nowMs: number): void;
  /** Another kind of calibration is shown now. */
  hide(): void;
  /** Number of the picture shown for each camera; -1 before the first. For tests. */
  shown(): Record<string, number>;
}

export interface ViewContext {
  readonly picturesHz: number;
  ask(name: string, args: Record<string, unknown>): Promise<Answer>;
  /** Shows the call anew: what it depends on has changed without a new state. */
  refresh(): void;
}
