/** One Track, or a blend of two, in arrays that are written again and again. */

import type { TrackMessage } from "../generated/messages";
import type { DrawnTrack } from "./drawn";

/** As many points as a Track may have. */
export const MOST_POINTS = 200;

export class Snapshot implements DrawnTrack {
  seq = -1;
  t = 0;
  status: TrackMessage["status"] = "lost";
  reason = "";
  readonly points = new Float64Array(3 * MOST_POINTS);
  count = 0;
  readonly tip = new Float64Array(3);
  readonly orientation = new Float64Array([1, 0, 0, 0]);
  sigmaMm: number | null = null;
  extrapolated = false;
  stale = false;
  behindMs = 0;
  /** Numbers that may be missing; NaN while they are. A field that holds either a number or null would allocate at each change. */
  private rollOrNaN = NaN;
  private delayOrNaN = NaN;

  get roll(): number | null {
    return Number.isNaN(this.rollOrNaN) ? null : this.rollOrNaN;
  }

  set roll(value: number | null) {
    this.rollOrNaN = value ?? NaN;
  }

  get delayMs(): number | null {
    return Number.isNaN(this.delayOrNaN) ? null : this.delayOrNaN;
  }

  set delayMs(value: number | null) {
    this.delayOrNaN = value ?? NaN;
  }

  /** Takes a Track as it came; one without a pose, or with fewer than two points, is taken as lost. */
  take(track: TrackMessage): void {
    const { points, tip } = track;
    this.seq = track.seq;
    this.t = track.t;
    this.reason = track.reason;
    this.sigmaMm = track.sigma_mm;
    if (track.status === "lost" || points === null || tip === null || points.length < 2) {
      this.status = "lost";
      this.count = 0;
      this.roll = null;
      return;
    }
    this.status = track.status;
    this.count = Math.min(points.length, MOST_POINTS);
    for (let i = 0; i < this.count; i++) {
      const point = points[i]!;
      for (let axis = 0; axis < 3; axis++) this.points[3 * i + axis] = point[axis]!;
    }
    for (let axis = 0; axis < 3; axis++) this.tip[axis] = tip.position[axis]!;
    for (let part = 0; part < 4; part++) this.orientation[part] = tip.orientation_wxyz[part]!;
    this.roll = track.roll;
  }

  /** Takes over everything but the instant's bookkeeping (t, behind, delay). */
  copy(other: Snapshot): void {
    this.seq = other.seq;
    this.status = other.status;
    this.reason = other.reason;
    this.count = other.count;
    this.points.set(other.points);
    this.tip.set(other.tip);
    this.orientation.set(other.orientation);
    this.rollOrNaN = other.rollOrNaN;
    this.sigmaMm = other.sigmaMm;
  }
}
