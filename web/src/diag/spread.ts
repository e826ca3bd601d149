/** How measured times are spread: kept as counts, so that an hour of frames takes no more room than a second. */

import type { Spread } from "../generated/messages";

const STEP_MS = 0.05;
const BINS = 10_000; // up to half a second

export class SpreadMeter {
  private readonly bins = new Uint32Array(BINS + 1);
  private count = 0;
  private longest = 0;

  /** Takes one time, ms; what is not a time from 0 on is left out. */
  add(ms: number): void {
    if (!(ms >= 0) || ms === Infinity) return;
    this.bins[Math.min(BINS, Math.floor(ms / STEP_MS))]! += 1;
    this.count += 1;
    if (ms > this.longest) this.longest = ms;
  }

  clear(): void {
    this.bins.fill(0);
    this.count = 0;
    this.longest = 0;
  }

  /** Returns what came so far, to 0.05 ms (the longest exactly); null before the first. */
  spread(): Spread | null {
    if (this.count === 0) return null;
    const median = this.quantile(0.5);
    return {
      count: this.count,
      median,
      p95: this.quantile(0.95),
      p99: this.quantile(0.99),
      longest: rounded(this.longest),
      over: this.over(1.5 * median),
    };
  }

  private quantile(share: number): number {
    const wanted = Math.max(1, Math.ceil(share * this.count));
    let sum = 0;
    for (let bin = 0; bin < BINS; bin++) {
      sum += this.bins[bin]!;
      if (sum >= wanted) return rounded(Math.min(this.longest, (bin + 0.5) * STEP_MS));
    }
    return rounded(this.longest);
  }

  private over(limitMs: number): number {
    let sum = 0;
    for (let bin = Math.floor(limitMs / STEP_MS) + 1; bin <= BINS; bin++) sum += this.bins[bin]!;
    return sum;
  }
}

function rounded(ms: number): number {
  return Math.round(ms * 1000) / 1000;
}
