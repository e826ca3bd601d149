/** The catheter as it is to be drawn at one instant. */

import type { TrackMessage } from "../generated/messages";

/** The same object each frame, written anew: what is to be kept of it must be copied. */
export interface DrawnTrack {
  /** Of the newest Track that it was made from. */
  readonly seq: number;
  /** The instant that it shows, seconds of the Tracks' own clock. */
  readonly t: number;
  readonly status: TrackMessage["status"];
  readonly reason: string;
  /** K points, mm, `box`, tip first: x y z after another; only the first 3 * count numbers count. */
  readonly points: Float64Array;
  readonly count: number;
  /** Tip, mm, `box`. */
  readonly tip: Float64Array;
  /** box_from_tip, unit quaternion w x y z. */
  readonly orientation: Float64Array;
  /** Unwrapped, rad; null without a valid roll. */
  readonly roll: number | null;
  readonly sigmaMm: number | null;
  /** Carried on beyond the newest Track, by at most one interval of Tracks. */
  readonly extrapolated: boolean;
  /** Nothing new has come for so long that this is no longer what is. */
  readonly stale: boolean;
  /** How far behind the newest Track's instant the drawing is, and how far behind the world, ms; null where unknown. */
  readonly behindMs: number;
  readonly delayMs: number | null;
}
