/** Estimates the host's monotonic clock from pings and pongs. */

/** How long one measurement counts, seconds: clocks drift, so that old ones must go. */
const KEEP_S = 60;
const CAPACITY = 32;

/**
 * Keeps the last measurements and believes the one with the shortest round trip: its error is at most half of that
 * round trip (Cristian's method).
 */
export class ClockOffset {
  private readonly offsets = new Float64Array(CAPACITY);
  private readonly roundTrips = new Float64Array(CAPACITY);
  private readonly instants = new Float64Array(CAPACITY);
  private count = 0;
  private best = -1;

  /** Takes one exchange: sent and received by the page's clock, answered by the host's; all seconds. */
  add(sentS: number, answeredS: number, receivedS: number): void {
    if (!(receivedS >= sentS)) return;
    const slot = this.count++ % CAPACITY;
    this.offsets[slot] = answeredS - (sentS + receivedS) / 2;
    this.roundTrips[slot] = receivedS - sentS;
    this.instants[slot] = receivedS;
    this.best = -1;
    for (let i = 0; i < Math.min(this.count, CAPACITY); i++) {
      if (receivedS - this.instants[i]! > KEEP_S) continue;
      if (this.best < 0 || this.roundTrips[i]! < this.roundTrips[this.best]!) this.best = i;
    }
  }

  /** Host seconds minus page seconds; null before the first exchange. */
  get offsetS(): number | null {
    return this.best < 0 ? null : this.offsets[this.best]!;
  }

  /** The shortest recent round trip; null before the first exchange. */
  get roundTripS(): number | null {
    return this.best < 0 ? null : this.roundTrips[this.best]!;
  }

  /** Forgets everything: another host has another clock. */
  clear(): void {
    this.count = 0;
    this.best = -1;
  }
}
