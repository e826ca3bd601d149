/** Distances and angles from a tip and a beam to a place, and how long they must be good for the place to be reached. */

const DEGREES = 180 / Math.PI;
/** Nearer than this there is no way left whose direction could be told. */
const ARRIVED_MM = 0.5;

export interface TargetMeasure {
  /** From the tip to the target, mm. */
  distanceMm: number;
  /** Between the tip's direction (its z axis) and the way to the target, degrees, 0 to 180. */
  angleDeg: number;
  /** From the beam's middle line, from the array's face to the end of its depth, to the target, mm. */
  beamDistanceMm: number;
  /** Between the beam's direction (the tip's x axis) and the way from the array's middle to the target, degrees. */
  beamAngleDeg: number;
  /** The place on that middle line that is nearest to the target, mm, `box`. */
  readonly foot: Float64Array;
}

/** Returns a measure to write to. */
export function makeTargetMeasure(): TargetMeasure {
  return { distanceMm: 0.1, angleDeg: 0.1, beamDistanceMm: 0.1, beamAngleDeg: 0.1, foot: new Float64Array(3) };
}

/**
 * Writes how a target lies. pose: box_from_tip, 16 numbers column by column (three's order), mm; x, y, z: the target, mm,
 * `box`; array: the middle of the array's face in the tip's frame, mm; depthMm: how far the beam reaches. At the target
 * itself angles are 0.
 */
export function measureTarget(
  out: TargetMeasure, pose: ArrayLike<number>, x: number, y: number, z: number, array: readonly [number, number, number], depthMm: number,
): void {
  const dx = x - pose[12]!, dy = y - pose[13]!, dz = z - pose[14]!;
  out.distanceMm = Math.sqrt(dx * dx + dy * dy + dz * dz); // Math.hypot allocates
  out.angleDeg = angleTo(pose, 8, dx, dy, dz);
  const a = array[0], b = array[1], c = array[2];
  const ux = dx - (a * pose[0]! + b * pose[4]! + c * pose[8]!);
  const uy = dy - (a * pose[1]! + b * pose[5]! + c * pose[9]!);
  const uz = dz - (a * pose[2]! + b * pose[6]! + c * pose[10]!);
  out.beamAngleDeg = angleTo(pose, 0, ux, uy, uz);
  const along = Math.min(Math.max(ux * pose[0]! + uy * pose[1]! + uz * pose[2]!, 0), depthMm);
  const vx = ux - along * pose[0]!, vy = uy - along * pose[1]!, vz = uz - along * pose[2]!;
  out.beamDistanceMm = Math.sqrt(vx * vx + vy * vy + vz * vz);
  out.foot[0] = x - vx;
  out.foot[1] = y - vy;
  out.foot[2] = z - vz;
}

/** Returns the angle between a column of a pose and a way, degrees. */
function angleTo(pose: ArrayLike<number>, column: number, x: number, y: number, z: number): number {
  if (x * x + y * y + z * z < ARRIVED_MM ** 2) return 0;
  const ax = pose[column]!, ay = pose[column + 1]!, az = pose[column + 2]!;
  const along = ax * x + ay * y + az * z;
  const cx = ay * z - az * y, cy = az * x - ax * z, cz = ax * y - ay * x;
  const across = Math.sqrt(cx * cx + cy * cy + cz * cz);
  return Math.atan2(across, along) * DEGREES;
}

/** What must come to a target: the tip, or the beam's middle line. */
export type ReachBy = "tip" | "beam";

/** What it takes to reach a target. */
export interface ReachRule {
  readonly radiusMm: number;
  readonly angleDeg: number;
  readonly dwellS: number;
  /** Not told: the tip. */
  readonly by?: ReachBy;
}

/** For targets of which no more than the place is told, their radius apart. */
export const REACH_RULE: ReachRule = { radiusMm: 5, angleDeg: 15, dwellS: 1 };

/** Who is within stays within until this much further out: noise at the edge does not begin the wait anew. */
const EDGE = 1.1;
/** Of the radius: a tip this near to the middle is there, whichever way it looks, for the way left to go says nothing any more. */
const THERE = 0.5;

/** Counts the time that a tip, or a beam, stays within a target. */
export class Dwell {
  /** Whether the distance, the angle, and so both are good enough. */
  near = false;
  aligned = false;
  within = false;
  reached = false;
  private sinceS = 0;

  constructor(public rule: ReachRule = REACH_RULE) {}

  /** How much of the time has passed, 0 to 1. */
  get share(): number {
    return this.reached ? 1 : this.within ? Math.min(1, this.sinceS / Math.max(1e-6, this.rule.dwellS)) : 0;
  }

  /**
   * Takes the present distance and angle, and the time since the last ones, of which only what is measured counts: 0 for a
   * prediction. Returns whether the target is reached with this step.
   */
  step(distanceMm: number, angleDeg: number, dtS: number): boolean {
    const { radiusMm, by } = this.rule;
    const edge = this.within ? EDGE : 1;
    this.near = distanceMm <= radiusMm * edge;
    this.aligned = angleDeg <= this.rule.angleDeg * edge || (by !== "beam" && distanceMm <= THERE * radiusMm);
    const now = this.near && this.aligned;
    this.sinceS = now && this.within ? this.sinceS + dtS : 0;
    this.within = now;
    if (this.reached || !now || this.sinceS < this.rule.dwellS) return false;
    this.reached = true;
    return true;
  }

  /** Nothing is known of the tip: the wait begins anew, what was reached stays reached. */
  interrupt(): void {
    this.near = this.aligned = this.within = false;
    this.sinceS = 0;
  }

  clear(): void {
    this.interrupt();
    this.reached = false;
  }
}
