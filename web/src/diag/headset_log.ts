/** The frames of a session in a headset, kept on the device until somebody opens /diag there and sends them. */

import type { HeadsetFrames, Spread } from "../generated/messages";
import type { Feature, Frame } from "../stage/feature";
import { SpreadMeter } from "./spread";

const NAME = "cathxr.diag.headset";
/** The first pictures of a session come while it is being set up. */
const LEFT_OUT = 30;
/** A shorter session says little. */
const LEAST_FRAMES = 60;

/** What is asked in each frame: its JavaScript, ms, and what rate the headset says it has; null where that is not known. */
export interface Headset {
  scriptMs(): number | null;
  rateHz(): number | null;
}

export class HeadsetLog implements Feature {
  private readonly intervals = new SpreadMeter();
  private readonly script = new SpreadMeter();
  private mode: "vr" | "ar" | null = null;
  private rateHz: number | null = null;
  private frames = 0;
  private firstMs = 0;
  private lastMs = 0;

  constructor(private readonly storage: Storage | null, private readonly headset: Headset) {}

  /** A session has begun. */
  begin(mode: "vr" | "ar"): void {
    this.mode = mode;
    this.frames = 0;
    this.intervals.clear();
    this.script.clear();
  }

  /** Takes a frame's instant, ms. */
  recordFrame(nowMs: number): void {
    if (this.mode === null) return;
    this.frames += 1;
    if (this.frames === LEFT_OUT) this.firstMs = nowMs;
    if (this.frames % LEFT_OUT === 0) this.rateHz = this.headset.rateHz() ?? this.rateHz; // some say it only after a while
    if (this.frames > LEFT_OUT) {
      this.intervals.add(nowMs - this.lastMs);
      const script = this.headset.scriptMs();
      if (script !== null) this.script.add(script);
    }
    this.lastMs = nowMs;
  }

  update(frame: Frame): boolean {
    if (frame.immersive) this.recordFrame(frame.nowMs);
    return false;
  }

  /** The session has ended: its figures are kept, unless it was too short. */
  end(): void {
    const figures = this.figures();
    this.mode = null;
    this.rateHz = null;
    if (figures === null) return;
    try {
      this.storage?.setItem(NAME, JSON.stringify(figures));
    } catch {
      // a full or forbidden storage: the figures are lost, which harms nobody
    }
  }

  private figures(): HeadsetFrames | null {
    const intervals = this.intervals.spread();
    if (this.mode === null || intervals === null || intervals.count < LEAST_FRAMES) return null;
    return {
      mode: this.mode,
      seconds: Math.round((this.lastMs - this.firstMs) / 100) / 10,
      rate_hz: this.rateHz,
      intervals_ms: intervals,
      script_ms: this.script.spread(),
    };
  }
}

/** Returns the figures of the last session on this device; null where there are none that can be read. */
export function lastHeadsetFrames(storage: Storage | null): HeadsetFrames | null {
  try {
    const found = JSON.parse(storage?.getItem(NAME) ?? "null") as HeadsetFrames | null;
    if (found === null || (found.mode !== "vr" && found.mode !== "ar") || !isSpread(found.intervals_ms)) return null;
    return found;
  } catch {
    return null;
  }
}

function isSpread(value: unknown): value is Spread {
  return typeof value === "object" && value !== null && typeof (value as Spread).median === "number";
}
