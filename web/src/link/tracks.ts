/** The last Tracks, found again by their pair's number when that pair's picture arrives. */

import type { TrackMessage } from "../generated/messages";

const CAPACITY = 256; // four seconds at 60 Hz: far longer than a picture takes

export class TrackLog {
  private readonly slots: (TrackMessage | null)[] = new Array<TrackMessage | null>(CAPACITY).fill(null);
  newest: TrackMessage | null = null;

  put(track: TrackMessage): void {
    this.slots[track.seq % CAPACITY] = track;
    this.newest = track;
  }

  /** Returns the Track of a pair; null where it has not come or is too old. */
  get(seq: number): TrackMessage | null {
    const found = this.slots[seq % CAPACITY] ?? null;
    return found !== null && found.seq === seq ? found : null;
  }

  /** Numbers of the Tracks that are kept. */
  received(): number[] {
    return this.slots.flatMap((track) => (track === null ? [] : [track.seq]));
  }

  clear(): void {
    this.slots.fill(null);
    this.newest = null;
  }
}
