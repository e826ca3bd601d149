/** Distances and angles from a tip and a beam to a place, and how long they must be good for the place to be reached. */

const DEGREES = 180 / Math.PI;
/** Nearer than this there is no way left whose direction could be told. */
const ARRIVED_MM = 0.5;

export interface TargetMeasure {
  /** From the tip to the target, mm. */
  distanceMm: number;
  /** Between the tip's direction (its z axis) and the way to the target, degrees, 0 to 180. */
  angleDeg: number;
  /** Between the beam's direction (the tip's x axis) and the way from the array's middle to the target, degrees. */
  beamAngleDeg: number;
}

/**
 * Writes how a target lies. pose: box_from_tip, 16 numbers column by column (three's order), mm; x, y, z: the target, mm,
 * `box`; array: the middle of the array's face in the tip's frame, mm. At the target itself angles are 0.
 */
export function measureTarget(
  out: TargetMeasure, pose: ArrayLike<number>, x: number, y: number, z: number, array: readonly [number, number, number],
): void {
  const dx = x - pose[12]!, dy = y - pose[13]!, dz = z - pose[14]!;
  out.distanceMm = Math.hypot(dx, dy, dz);
  out.angleDeg = angleTo(pose, 8, dx, dy, dz);
  const a = array[0], b = array[1], c = array[2];
  out.beamAngleDeg = angleTo(
    pose,
    0,
    dx - (a * pose[0]! + b * pose[4]! + c * pose[8]!),
    dy - (a * pose[1]! + b * pose[5]! + c * pose[9]!),
    dz - (a * pose[2]! + b * pose[6]! + c * pose[10]!),
  );
}

/** Returns the angle between a column of a pose and a way, degrees. */
function angleTo(pose: ArrayLike<number>, column: number, x: number, y: number, z: number): number {
  const length = Math.hypot(x, y, z);
  if (length < ARRIVED_MM) return 0;
  const ax = pose[column]!, ay = pose[column + 1]!, az = pose[column + 2]!;
  const along = ax * x + ay * y + az * z;
  const across = Math.hypot(ay * z - az * y, az * x - ax * z, ax * y - ay * x);
  return Math.atan2(across, along) * DEGREES;
}

/** What it takes to reach a target. */
export interface ReachRule {
  readonly radiusMm: number;
  readonly angleDeg: number;
  readonly dwellS: number;
}

export const REACH_RULE: ReachRule = { radiusMm: 5, angleDeg: 15, dwellS: 1 };

/** Who is within stays within until this much further out: noise at the edge does not begin the wait anew. */
const EDGE = 1.1;

/** Counts the time that a tip stays within a target. */
export class Dwell {
  within = false;
  reached = false;
  private sinceS = 0;

  constructor(public rule: ReachRule = REACH_RULE) {}

  /** How much of the time has passed, 0 to 1. */
  get share(): number {
    return this.reached ? 1 : this.within ? Math.min(1, this.sinceS / Math.max(1e-6, this.rule.dwellS)) : 0;
  }

  /** Takes the present distance and angle; returns whether the target is reached with this step. */
  step(distanceMm: number, angleDeg: number, dtS: number): boolean {
    const edge = this.within ? EDGE : 1;
    const now = distanceMm <= this.rule.radiusMm * edge && angleDeg <= this.rule.angleDeg * edge;
    this.sinceS = now && this.within ? this.sinceS + dtS : 0;
    this.within = now;
    if (this.reached || !now || this.sinceS < this.rule.dwellS) return false;
    this.reached = true;
    return true;
  }

  /** Nothing is known of the tip: the wait begins anew, what was reached stays reached. */
  interrupt(): void {
    this.within = false;
    this.sinceS = 0;
  }

  clear(): void {
    this.interrupt();
    this.reached = false;
  }
}
