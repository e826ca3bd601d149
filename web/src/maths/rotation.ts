/** Unit quaternions w x y z in flat arrays: turns about z, and the way between two of them. No allocation. */

type Four = Float64Array;

/** Writes q followed by a turn by `angle` (rad) about its own z axis: q Rz(angle). `out` may be q. */
export function turnAboutZInto(out: Four, q: Four, angle: number): void {
  const c = Math.cos(angle / 2);
  const s = Math.sin(angle / 2);
  const w = q[0]!, x = q[1]!, y = q[2]!, z = q[3]!;
  out[0] = w * c - z * s;
  out[1] = x * c + y * s;
  out[2] = y * c - x * s;
  out[3] = z * c + w * s;
}

/** Writes the rotation a share of the short way from a to b; shares below 0 and above 1 go on beyond. `out` may be a or b. */
export function slerpInto(out: Four, a: Four, b: Four, share: number): void {
  let dot = a[0]! * b[0]! + a[1]! * b[1]! + a[2]! * b[2]! + a[3]! * b[3]!;
  const sign = dot < 0 ? -1 : 1;
  dot = Math.min(1, dot * sign);
  let p = 1 - share;
  let r = share * sign;
  if (dot < 0.99999) {
    const angle = Math.acos(dot);
    const sine = Math.sin(angle);
    p = Math.sin((1 - share) * angle) / sine;
    r = (sign * Math.sin(share * angle)) / sine;
  }
  let squared = 0;
  for (let i = 0; i < 4; i++) {
    const value = p * a[i]! + r * b[i]!;
    out[i] = value;
    squared += value * value;
  }
  const scale = squared > 0 ? 1 / Math.sqrt(squared) : 0;
  for (let i = 0; i < 4; i++) out[i]! *= scale;
}

/** Returns the angle between two rotations, rad, 0 to pi. */
export function angleBetween(a: Four, b: Four): number {
  const dot = Math.abs(a[0]! * b[0]! + a[1]! * b[1]! + a[2]! * b[2]! + a[3]! * b[3]!);
  return 2 * Math.acos(Math.min(1, dot));
}
