/** Plays a run that was recorded: which instant is shown, and where the catheter was then. Pure; allocates nothing per frame. */

import type { RunPath } from "../generated/messages";

/** A longer gap between two samples is not bridged, s. */
const GAP_S = 0.5;

export class RunPlayer {
  readonly durationS: number;
  /** The instant that is shown, s since the trial began. */
  timeS = 0;
  playing = false;
  /** 1: as it was. */
  speed = 1;

  constructor(readonly path: RunPath) {
    this.durationS = path.t.at(-1) ?? 0;
  }

  get ended(): boolean {
    return this.timeS >= this.durationS;
  }

  play(): void {
    if (this.ended) this.timeS = 0;
    this.playing = this.durationS > 0;
  }

  pause(): void {
    this.playing = false;
  }

  seek(timeS: number): void {
    this.timeS = Math.min(this.durationS, Math.max(0, timeS));
  }

  /** Moves on; returns whether what is shown has changed. */
  step(dtS: number): boolean {
    if (!this.playing) return false;
    this.timeS = Math.min(this.durationS, this.timeS + dtS * this.speed);
    if (this.ended) this.playing = false;
    return true;
  }

  /** Returns the number of the last sample at or before an instant; -1 before the first. */
  indexAt(timeS: number): number {
    const { t } = this.path;
    let low = 0;
    let high = t.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (t[middle]! <= timeS) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /**
   * Writes the catheter's points at the present instant, x y z after another, tip first; returns how many, 0 where it was
   * not tracked. Between two samples with as many points it goes straight.
   */
  shapeAt(out: Float64Array): number {
    const { t, shape } = this.path;
    const at = this.indexAt(this.timeS);
    const a = at < 0 ? null : shape[at] ?? null;
    if (a === null) return 0;
    const b = shape[at + 1] ?? null;
    const span = b === null ? 0 : t[at + 1]! - t[at]!;
    const share = b === null || b.length !== a.length || span > GAP_S || span <= 0 ? 0 : (this.timeS - t[at]!) / span;
    const count = Math.min(a.length, Math.floor(out.length / 3));
    for (let i = 0; i < count; i++) {
      for (let axis = 0; axis < 3; axis++) {
        const from = a[i]![axis]!;
        out[3 * i + axis] = share === 0 ? from : from + share * (b![i]![axis]! - from);
      }
    }
    return count;
  }

  /** Returns the beam's direction at the present instant; null where it was not known. */
  beamAt(): readonly [number, number, number] | null {
    const at = this.indexAt(this.timeS);
    return at < 0 ? null : this.path.beam[at] ?? null;
  }

  /** How many targets were reached by now. */
  reachedBy(): number {
    let count = 0;
    for (let i = 0; i < this.path.reached.length; i++) if (this.path.reached[i]![1] <= this.timeS) count += 1;
    return count;
  }
}
