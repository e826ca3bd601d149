/** Makes what is drawn at the display's rate from Tracks that come at the cameras'. */

import type { TrackMessage } from "../generated/messages";
import { blendInto } from "./blend";
import type { DrawnTrack } from "./drawn";
import { RestFilter } from "./rest_filter";
import { Snapshot } from "./snapshot";
import { Timeline } from "./timeline";

/** Tracks that are kept: more than come in the longest delay and in a burst after a stall. */
const KEPT = 32;
/** Between Tracks further apart than this nothing is known: the older is held, then the newer stands. */
const BRIDGE_S = 0.25;
/** After this long without a Track what is drawn is marked as stale. */
export const STALE_S = 1.5;
/** A wrong guess is taken back with this time constant, so that nothing jumps. */
const SETTLE_S = 0.04;
/** Pictures further apart than this are not seen as motion. */
const FRAME_S = 0.025;
/** A catheter found again elsewhere, or a wrong guess of this size, jumps. */
const SETTLE_MOST_MM = 8;
/** So many Tracks in a row that are older than what is known: time has gone back (a seek). */
const BACK = 3;

export class Interpolator {
  private readonly ring = Array.from({ length: KEPT }, () => new Snapshot());
  private kept = 0;
  private readonly timeline = new Timeline();
  private readonly filter = new RestFilter();
  private readonly drawn = new Snapshot();
  private readonly guess = new Snapshot();
  private readonly correction = new Float64Array(this.drawn.points.length);
  private correcting = false;
  private correctedCount = 0;
  /** How many Tracks there were when the drawing last went beyond them; 0: it did not. */
  private guessedFrom = 0;
  private arrivedS = 0;
  private sampledS = 0;
  private older = 0;
  /** Whether Tracks of a recording are played: their instants are not now. */
  private replayed = false;

  clear(): void {
    this.kept = 0;
    this.older = 0;
    this.correcting = false;
    this.guessedFrom = 0;
    this.timeline.clear();
    this.filter.clear();
  }

  /** Begins with another stream: another server, whose cameras may be noisier. */
  forget(): void {
    this.clear();
    this.filter.forget();
  }

  /** Takes a Track as it comes. nowS: the page's clock. */
  put(track: TrackMessage, nowS: number): void {
    this.arrivedS = nowS;
    const newest = this.kept > 0 ? this.ring[(this.kept - 1) % KEPT]! : null;
    if (newest !== null && track.t <= newest.t) {
      if (track.t === newest.t && track.seq === newest.seq) return; // paused: the same again
      if (newest.t - track.t < BRIDGE_S && ++this.older < BACK) return; // overtaken on the way: too late to be of use
      this.clear();
    }
    this.older = 0;
    if (this.timeline.put(track.t, nowS)) {
      this.kept = 0;
      this.guessedFrom = 0;
      this.filter.clear();
    }
    const slot = this.ring[this.kept++ % KEPT]!;
    slot.take(track);
    this.filter.apply(slot);
    this.replayed = track.latency_ms === null;
  }

  /**
   * Returns what to draw now; null before the first Track. The same object each time. Allocates nothing.
   *
   * offsetS: the host's clock minus the page's, null where unknown; it only says how long ago the world looked like that.
   */
  sample(nowS: number, offsetS: number | null): DrawnTrack | null {
    if (this.kept === 0) return null;
    const { drawn, timeline } = this;
    timeline.step(nowS);
    const newest = this.ring[(this.kept - 1) % KEPT]!;
    this.place(newest);
    this.settle(nowS);
    drawn.stale = nowS - this.arrivedS > STALE_S;
    drawn.behindMs = 1000 * (newest.t - drawn.t);
    drawn.delayMs = offsetS === null || this.replayed || drawn.stale ? null : 1000 * (nowS + offsetS - drawn.t);
    this.sampledS = nowS;
    return drawn;
  }

  /** How long the drawing waits for Tracks now, ms: its own part of the delay. */
  get waitMs(): number {
    return 1000 * this.timeline.delayS;
  }

  /** Writes the pose at the timeline's instant, and the instant that it really shows. (Numbers that are handed on are allocated.) */
  private place(newest: Snapshot): void {
    const { drawn } = this;
    const { t } = this.timeline;
    let after: Snapshot | null = null;
    let before = newest;
    for (let back = 1; t < before.t && back < Math.min(this.kept, KEPT); back++) {
      after = before;
      before = this.ring[(this.kept - 1 - back) % KEPT]!;
    }
    drawn.extrapolated = false;
    if (after !== null && t >= before.t && this.joined(before, after)) {
      drawn.copy(before);
      drawn.t = t;
      drawn.seq = after.seq;
      blendInto(drawn, before, after, (t - before.t) / (after.t - before.t));
    } else if (after === null && t > before.t) {
      this.carryOn(before);
    } else {
      drawn.copy(before);
      drawn.t = before.t;
    }
  }

  /** Goes on beyond the newest Track as it last moved, for at most one interval of Tracks. */
  private carryOn(newest: Snapshot): void {
    const { drawn } = this;
    drawn.copy(newest);
    drawn.t = newest.t;
    if (this.kept < 2) return;
    const before = this.ring[(this.kept - 2) % KEPT]!;
    if (!this.joined(before, newest)) return;
    const ahead = Math.min(this.timeline.t - newest.t, this.mostAhead(before, newest));
    blendInto(drawn, before, newest, 1 + ahead / (newest.t - before.t));
    drawn.extrapolated = true;
    drawn.t = newest.t + ahead;
  }

  private joined(a: Snapshot, b: Snapshot): boolean {
    return a.status !== "lost" && b.status !== "lost" && b.t - a.t <= BRIDGE_S && b.t > a.t;
  }

  /** Takes a wrong guess back little by little instead of at once, once the Tracks that it was a guess of are there. */
  private settle(nowS: number): void {
    const { drawn, guess, correction } = this;
    const length = 3 * drawn.count;
    const guessedFrom = this.guessedFrom;
    this.guessedFrom = drawn.extrapolated ? this.kept : 0;
    if (drawn.status === "lost" || this.correctedCount !== drawn.count) {
      this.correctedCount = drawn.count;
      this.correcting = false;
      return;
    }
    if (this.correcting) {
      const left = Math.exp(-(nowS - this.sampledS) / SETTLE_S);
      let most = 0;
      for (let i = 0; i < length; i++) most = Math.max(most, Math.abs((correction[i]! *= left)));
      this.correcting = most > 1e-4;
    }
    const come = this.kept - guessedFrom;
    if (guessedFrom >= 2 && come > 0 && come < KEPT - 2) {
      const b = this.ring[(guessedFrom - 1) % KEPT]!;
      const a = this.ring[(guessedFrom - 2) % KEPT]!;
      const ahead = Math.min(drawn.t - b.t, this.mostAhead(a, b));
      blendInto(guess, a, b, 1 + Math.max(0, ahead) / (b.t - a.t));
      this.correct(length, nowS - this.sampledS);
    }
    if (!this.correcting) return;
    for (let i = 0; i < length; i++) drawn.points[i]! += correction[i]!;
    for (let axis = 0; axis < 3; axis++) drawn.tip[axis]! += correction[axis]!;
  }

  /** Adds what the guess was off by to the correction; a catheter found elsewhere jumps. */
  private correct(length: number, sinceS: number): void {
    const { drawn, guess, correction } = this;
    if (guess.count !== drawn.count) return;
    if (!this.correcting) correction.fill(0);
    this.correcting = true;
    // After a long pause between two pictures nobody sees a jump any more, but would see the wrong place.
    const share = Math.exp(-Math.max(0, sinceS - FRAME_S) / SETTLE_S);
    for (let i = 0; i < length; i++) correction[i]! += share * (guess.points[i]! - drawn.points[i]!);
    if (correction[0]! ** 2 + correction[1]! ** 2 + correction[2]! ** 2 > SETTLE_MOST_MM ** 2) this.correcting = false;
  }

  private mostAhead(before: Snapshot, newest: Snapshot): number {
    return Math.min(newest.t - before.t, 2 * this.timeline.intervalS);
  }
}
