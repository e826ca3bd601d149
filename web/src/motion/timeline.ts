/** Which instant of the Tracks' clock to draw now: as late as is needed for the next Track to have come, and no later. */

import { nth } from "../maths/statistics";

/** Tracks that are looked back on. */
const CAPACITY = 512;
/** How long the quickest Track counts: clocks drift apart by less than a millisecond in that time. */
const BASE_WINDOW_S = 10;
const NEED_WINDOW_S = 4;
/** This share of the Tracks comes in time. */
const IN_TIME = 0.98;
const MARGIN_S = 0.002;
/** A longer wait is felt as lag in the hand; what comes later than this is bridged by carrying on. */
export const MOST_DELAY_S = 0.06;
/** But at least so many intervals may be waited: a motion at 10 Hz that is carried on all the time overshoots at every stop. */
const MOST_DELAY_INTERVALS = 1.2;
/** How much slower and faster than true the drawn motion may run while the delay is being changed. */
const SLOW_DOWN = 0.06;
const SPEED_UP = 0.02;
/** A Track this much earlier or later than the others belongs to another course of time: a seek, a pause, a new server. */
const RESTART_S = 0.5;
/** From this far off it is better to jump than to catch up. */
const JUMP_S = 0.25;

/**
 * The quickest of the last Tracks tells how the two clocks stand to each other, the journey included; how much later the
 * others came, and how far apart they are, tells how long to wait. No clock exchange is needed, so that it works for a
 * replay too, and an improved estimate of the host's clock moves nothing.
 */
export class Timeline {
  private readonly arrivals = new Float64Array(CAPACITY);
  /** Arrival by the page's clock minus the Track's instant. */
  private readonly lateness = new Float64Array(CAPACITY);
  /** From the instant of the Track before to this one's arrival, without `base`. */
  private readonly gaps = new Float64Array(CAPACITY);
  private readonly sorted = new Float64Array(CAPACITY);
  private count = 0;
  private newestT = 0;
  private base = 0;
  /** Of the Tracks' clock against the page's as it is drawn now; NaN: not yet. */
  private shift = NaN;
  private lastNowS = 0;
  /** The instant to draw, on the Tracks' clock. */
  t = 0;
  /** What is waited for now, seconds. */
  delayS = 0;
  /** Median distance of the last Tracks, seconds. */
  intervalS = 1 / 60;

  clear(): void {
    this.count = 0;
    this.shift = NaN;
    this.delayS = 0;
  }

  /** Takes a Track's instant and its arrival by the page's clock. Returns whether time has begun anew with it. */
  put(t: number, arrivalS: number): boolean {
    const late = arrivalS - t;
    const begins = this.count === 0 || Math.abs(late - this.base) > RESTART_S;
    if (begins) this.clear();
    const slot = this.count++ % CAPACITY;
    this.arrivals[slot] = arrivalS;
    this.lateness[slot] = late;
    this.gaps[slot] = begins ? 0 : t - this.newestT;
    this.newestT = t;
    this.measure(arrivalS);
    return begins;
  }

  /** Works out the instant to draw now. It never goes back but when time has begun anew. */
  step(nowS: number): void {
    const wanted = -this.base - this.delayS;
    const passed = Math.max(0, nowS - this.lastNowS);
    this.lastNowS = nowS;
    if (!(Math.abs(wanted - this.shift) <= JUMP_S)) this.shift = wanted;
    else this.shift += Math.min(Math.max(wanted - this.shift, -SLOW_DOWN * passed), SPEED_UP * passed);
    this.t = nowS + this.shift;
  }

  private measure(nowS: number): void {
    const kept = Math.min(this.count, CAPACITY);
    let base = Infinity;
    for (let i = 0; i < kept; i++) {
      if (nowS - this.arrivals[i]! <= BASE_WINDOW_S) base = Math.min(base, this.lateness[i]!);
    }
    this.base = base;
    let known = 0;
    for (let i = 0; i < kept; i++) {
      if (nowS - this.arrivals[i]! > NEED_WINDOW_S || this.gaps[i]! <= 0 || this.gaps[i]! > RESTART_S) continue;
      this.sorted[known++] = this.gaps[i]!;
    }
    if (known === 0) return;
    this.intervalS = this.quantile(known, 0.5);
    known = 0;
    for (let i = 0; i < kept; i++) {
      if (nowS - this.arrivals[i]! > NEED_WINDOW_S || this.gaps[i]! <= 0) continue;
      this.sorted[known++] = this.gaps[i]! + this.lateness[i]! - base;
    }
    const most = Math.max(MOST_DELAY_S, MOST_DELAY_INTERVALS * this.intervalS);
    this.delayS = Math.min(most, this.quantile(known, IN_TIME) + MARGIN_S);
  }

  /** Returns a quantile of the first numbers of `sorted`, which come out of their order. */
  private quantile(known: number, share: number): number {
    return nth(this.sorted, known, Math.min(known - 1, Math.floor(share * known)));
  }
}
