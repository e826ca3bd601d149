/** Rigid transforms as the wire gives them: a unit quaternion (w, x, y, z) and a translation in mm. */

export type Vector3 = readonly [number, number, number];
export type Quaternion = readonly [number, number, number, number];

/** Writes the row-major 3x3 rotation matrix of a quaternion (w, x, y, z) to `out` (9 numbers). */
export function rotationInto(out: Float64Array, quaternion: Quaternion | Float64Array): void {
  const w = quaternion[0]!, x = quaternion[1]!, y = quaternion[2]!, z = quaternion[3]!;
  out[0] = 1 - 2 * (y * y + z * z);
  out[1] = 2 * (x * y - w * z);
  out[2] = 2 * (x * z + w * y);
  out[3] = 2 * (x * y + w * z);
  out[4] = 1 - 2 * (x * x + z * z);
  out[5] = 2 * (y * z - w * x);
  out[6] = 2 * (x * z - w * y);
  out[7] = 2 * (y * z + w * x);
  out[8] = 1 - 2 * (x * x + y * y);
}
