/** What tests and curious people can ask about the guide. */

import type { Guide } from "./guide";
import { wordsOf } from "./steps";
import type { XrGuide } from "./xr_guide";

export interface GuideDebug {
  readonly phase: string;
  /** Of the present step; empty while the guide does not run. */
  readonly step: string;
  readonly steps: readonly string[];
  readonly done: boolean;
  readonly progress: string;
  readonly text: string;
  /** Whether the plate stands in the headset's room. */
  readonly plate: boolean;
  /** Where a button of the plate is, m in the room; null where there is none. */
  button(label: string): readonly [number, number, number] | null;
  start(anew: boolean): void;
}

export function guideDebug(guide: Guide, plate: XrGuide): GuideDebug {
  return {
    get phase() { return guide.phase; },
    get step() { return guide.step?.id ?? ""; },
    get steps() { return guide.steps.map(({ id }) => id); },
    get done() { return guide.done; },
    get progress() { return guide.progress; },
    get text() { return guide.step === null ? "" : wordsOf(guide.step, guide.situation); },
    get plate() { return plate.visible; },
    button: (label) => plate.whereIs(label),
    start: (anew) => guide.start(anew),
  };
}
