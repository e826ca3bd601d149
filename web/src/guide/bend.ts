/** How a catheter's flexible end is bent, from the points of its centreline. Pure; allocates nothing. */

/** Beyond this, measured from the tip, pushing and rolling move the flexible end as a whole. */
const BASE_MM = 60;
/** A direction is taken over this much of the line: shorter ones are noise. */
const CHORD_MM = 6;
const DEG = 180 / Math.PI;

export interface Bend {
  lengthMm: number;
  bendDeg: number;
  /** Of the bend, right-handed about the base's direction from box -y; 0 where there is no bend. */
  towardsDeg: number;
}

const tip = new Float64Array(3);
const base = new Float64Array(3);

/** Writes the bend of a line of `count` points, mm, `box`, tip first, at least two. */
export function measureBend(out: Bend, points: Float64Array, count: number): void {
  const length = lengthUpTo(points, count, Infinity);
  out.lengthMm = length;
  direction(tip, points, count, 0, CHORD_MM);
  direction(base, points, count, Math.max(0, Math.min(BASE_MM, length - CHORD_MM)), CHORD_MM);
  const [ax, ay, az] = [base[0]!, base[1]!, base[2]!];
  const [tx, ty, tz] = [tip[0]!, tip[1]!, tip[2]!];
  const along = ax * tx + ay * ty + az * tz;
  const across = Math.hypot(ay * tz - az * ty, az * tx - ax * tz, ax * ty - ay * tx);
  out.bendDeg = Math.atan2(across, along) * DEG;
  // u: -y made normal to the base; v = base x u.
  const ux = ax * ay, uy = ay * ay - 1, uz = az * ay;
  const size = Math.hypot(ux, uy, uz);
  if (size < 1e-6) {
    out.towardsDeg = 0;
    return;
  }
  const vx = ay * uz - az * uy, vy = az * ux - ax * uz, vz = ax * uy - ay * ux;
  out.towardsDeg = Math.atan2((tx * vx + ty * vy + tz * vz) / size, (tx * ux + ty * uy + tz * uz) / size) * DEG;
}

/** Writes the place that is `behindMm` behind the tip, along the line. */
export function pointBehind(out: Float64Array, points: Float64Array, count: number, behindMm: number): void {
  let gone = 0;
  for (let i = 3; i < 3 * count; i += 3) {
    const step = Math.hypot(points[i]! - points[i - 3]!, points[i + 1]! - points[i - 2]!, points[i + 2]! - points[i - 1]!);
    if (gone + step >= behindMm || i === 3 * (count - 1)) {
      const share = step > 0 ? Math.min(1, (behindMm - gone) / step) : 0;
      for (let axis = 0; axis < 3; axis++) out[axis] = points[i - 3 + axis]! + share * (points[i + axis]! - points[i - 3 + axis]!);
      return;
    }
    gone += step;
  }
}

const from = new Float64Array(3);
const to = new Float64Array(3);

/** Writes the unit direction towards the tip of the piece that begins `behindMm` behind the tip. */
export function direction(out: Float64Array, points: Float64Array, count: number, behindMm: number, chordMm: number): void {
  pointBehind(to, points, count, behindMm);
  pointBehind(from, points, count, behindMm + chordMm);
  const x = to[0]! - from[0]!, y = to[1]! - from[1]!, z = to[2]! - from[2]!;
  const size = Math.hypot(x, y, z) || 1;
  out[0] = x / size;
  out[1] = y / size;
  out[2] = z / size;
}

function lengthUpTo(points: Float64Array, count: number, most: number): number {
  let gone = 0;
  for (let i = 3; i < 3 * count && gone < most; i += 3) {
    gone += Math.hypot(points[i]! - points[i - 3]!, points[i + 1]! - points[i - 2]!, points[i + 2]! - points[i - 1]!);
  }
  return gone;
}
