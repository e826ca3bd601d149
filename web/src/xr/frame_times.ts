/** How long a headset's frames took: this page's share of each, and from one to the next. */

const KEPT = 512;

export class FrameTimes {
  /** Frames since the last `clear`. */
  count = 0;
  private readonly costs = new Float32Array(KEPT);
  private readonly intervals = new Float32Array(KEPT);
  private readonly sorted = new Float32Array(KEPT);
  private lastMs = -1;

  /** Takes when a frame's work began and ended, ms. */
  put(begunMs: number, endedMs: number): void {
    const slot = this.count % KEPT;
    this.costs[slot] = endedMs - begunMs;
    this.intervals[slot] = this.lastMs < 0 ? 0 : begunMs - this.lastMs;
    this.lastMs = begunMs;
    this.count += 1;
  }

  /** Of the last frame, ms; null before the first. */
  get lastCostMs(): number | null {
    return this.count === 0 ? null : this.costs[(this.count - 1) % KEPT]!;
  }

  clear(): void {
    this.count = 0;
    this.lastMs = -1;
  }

  /** Returns a quantile of the last frames' work, ms; share from 0 to 1. */
  costMs(share: number): number {
    return this.quantile(this.costs, share);
  }

  /** Returns a quantile of the last intervals between frames, ms. */
  intervalMs(share: number): number {
    return this.quantile(this.intervals, share);
  }

  private quantile(of: Float32Array, share: number): number {
    const count = Math.min(KEPT, this.count);
    if (count === 0) return 0;
    const sorted = this.sorted.subarray(0, count);
    sorted.set(of.subarray(0, count));
    sorted.sort();
    return sorted[Math.min(count - 1, Math.floor(share * count))]!;
  }
}
