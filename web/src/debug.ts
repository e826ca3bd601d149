/** What tests and curious people can ask the page: `window.__cathxr`. */

import type { SceneReport } from "./scene/report";
import type { GuideDebug } from "./guide/debug";
import type { TrainingDebug } from "./training/debug";
import type { XrDebug } from "./xr/report";

export interface DebugHandle {
  /** Frames drawn so far. */
  readonly frames: number;
  /** The newest Track's number, the instant that is drawn (s, the host's clock), where the tip is drawn, mm in `box`, and whether the beam is; null without a catheter. */
  drawn(): { seq: number; t: number; tip: [number, number, number]; beam: boolean } | null;
  /** Figures of the scene, and what the last frame cost. */
  scene(): SceneReport;
  /** What the status at the top says. */
  readonly status: string;
  readonly link: string;
  /** Links opened so far. */
  readonly connections: number;
  /** Numbers of the last Tracks that came, up to 256 of them. */
  received(): number[];
  /** Number of the newest Track; -1 before the first. */
  readonly lastSeq: number;
  /** Errors on the console, uncaught ones included. */
  readonly consoleErrors: number;
  readonly pixelRatio: number;
  readonly heartParts: number;
  readonly role: string;
  /** Where the page's camera is in the scene, m. */
  camera(): [number, number, number];
  /** Each camera panel's shown pair, and whether the curve of that pair is drawn over it. */
  pictures(): { camera: string; seq: number; overlaid: boolean }[];
  /** The headset's session, and what it shows. */
  readonly xr: XrDebug;
  readonly guide: GuideDebug;
  readonly training: TrainingDebug;
}

declare global {
  interface Window {
    __cathxr?: DebugHandle;
  }
}

/** Returns a counter of everything that goes to the console as an error, and of every uncaught error. */
export function countErrors(): { readonly count: number } {
  const counter = { count: 0 };
  const original = console.error;
  console.error = (...args: unknown[]): void => {
    counter.count += 1;
    original.apply(console, args);
  };
  addEventListener("error", () => (counter.count += 1));
  addEventListener("unhandledrejection", () => (counter.count += 1));
  return counter;
}
