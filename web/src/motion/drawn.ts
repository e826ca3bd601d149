/** The catheter as it is to be drawn at one instant. */

export interface DrawnTrack {
  /** Of the newest Track that it was made from. */
  readonly seq: number;
  readonly status: "tracked" | "coasting" | "lost";
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
  /** How far behind the newest Track's instant the drawing is, and how far behind the world, ms; null where unknown. */
  readonly behindMs: number;
  readonly delayMs: number | null;
}
