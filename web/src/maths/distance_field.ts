/** Signed distance to the wall, from a volume of labels: how far a place is from the edge of the blood. */

/** At most as many voxels as this: it is worked out in half a second and takes 8 MB. */
const MOST_VOXELS = 128 ** 3;
const FAR = 1e20;

/** What is known of a volume before its distances. All in mm and voxels of the volume itself. */
export interface Voxels {
  /** 1: blood, 0: not; i fastest. */
  readonly blood: Uint8Array;
  readonly size: readonly [number, number, number];
  readonly spacingMm: readonly [number, number, number];
  /** 16 numbers row by row: (x, y, z, 1) mm in `ct` to (i, j, k). */
  readonly voxelFromCt: Float64Array;
}

/** Positive within the blood: the way to the nearest wall, mm; negative outside: the way back to the blood. */
export interface DistanceField extends Omit<Voxels, "blood"> {
  readonly mm: Float32Array;
  /** First and last blood voxel along i, j, k; the extent of the heart. */
  readonly low: readonly [number, number, number];
  readonly high: readonly [number, number, number];
}

/**
 * Returns labels as blood or not, made coarser where there are too many voxels. bytes: i fastest, shape of `size`;
 * ctFromVoxel: 16 numbers row by row with axes at right angles; blood: the labels that are blood; most: voxels. Throws RangeError when
 * the numbers do not fit each other.
 */
export function bloodVoxels(
  bytes: Uint8Array, size: readonly [number, number, number], ctFromVoxel: readonly number[], blood: ReadonlySet<number>,
  most = MOST_VOXELS,
): Voxels {
  const [ni, nj, nk] = size;
  if (bytes.length !== ni * nj * nk) throw new RangeError(`The labels should have ${ni * nj * nk} bytes and have ${bytes.length}.`);
  const coarser = Math.max(1, Math.cbrt(bytes.length / most));
  const [mi, mj, mk] = size.map((n) => Math.max(1, Math.floor(n / coarser))) as [number, number, number];
  const step = [ni / mi, nj / mj, nk / mk] as const;
  const is = Uint8Array.from({ length: 256 }, (_, label) => (blood.has(label) ? 1 : 0));
  const result = new Uint8Array(mi * mj * mk);
  const at = (index: number, axis: 0 | 1 | 2): number => Math.min(size[axis] - 1, Math.floor((index + 0.5) * step[axis]));
  for (let k = 0, to = 0; k < mk; k++) {
    for (let j = 0; j < mj; j++) {
      const row = (at(k, 2) * nj + at(j, 1)) * ni;
      for (let i = 0; i < mi; i++) result[to++] = is[bytes[row + at(i, 0)]!]!;
    }
  }
  const columns = [0, 1, 2].map((axis) => [0, 1, 2].map((row) => ctFromVoxel[4 * row + axis]! * step[axis]!));
  const origin = [0, 1, 2].map((row) => ctFromVoxel[4 * row + 3]!
    + [0, 1, 2].reduce((sum, axis) => sum + ctFromVoxel[4 * row + axis]! * (0.5 * step[axis]! - 0.5), 0));
  const spacing = columns.map((column) => Math.hypot(...column)) as [number, number, number];
  if (!spacing.every((mm) => mm > 1e-6)) throw new RangeError("The labels' voxels have no size.");
  const voxelFromCt = new Float64Array(16);
  for (let axis = 0; axis < 3; axis++) {
    let shift = 0;
    for (let row = 0; row < 3; row++) {
      const value = columns[axis]![row]! / spacing[axis]! ** 2; // axes at right angles: the inverse is the scaled transpose
      voxelFromCt[4 * axis + row] = value;
      shift -= value * origin[row]!;
    }
    voxelFromCt[4 * axis + 3] = shift;
  }
  voxelFromCt[15] = 1;
  return { blood: result, size: [mi, mj, mk], spacingMm: spacing, voxelFromCt };
}

/**
 * Returns the signed distances of a volume. Exact for voxels' centres (Felzenszwalb and Huttenlocher 2012: squared
 * distances, axis by axis, as lower envelopes of parabolas); the wall lies half a voxel before the first voxel beyond it.
 */
export function distanceField(voxels: Voxels): DistanceField {
  const { blood, size, spacingMm, voxelFromCt } = voxels;
  const half = Math.cbrt(spacingMm[0] * spacingMm[1] * spacingMm[2]) / 2;
  const mm = new Float32Array(blood.length);
  for (const inside of [1, 0] as const) {
    const squared = new Float32Array(blood.length);
    for (let i = 0; i < blood.length; i++) squared[i] = blood[i] === inside ? FAR : 0;
    squaredDistances(squared, size, spacingMm);
    const sign = inside === 1 ? 1 : -1;
    for (let i = 0; i < blood.length; i++) {
      if (blood[i] === inside) mm[i] = sign * (Math.sqrt(squared[i]!) - half);
    }
  }
  const { low, high } = extent(blood, size);
  return { mm, size, spacingMm, voxelFromCt, low, high };
}

/** Replaces 0 (there) and FAR (not there) by the squared distance to the nearest that is there, mm squared. */
function squaredDistances(f: Float32Array, [ni, nj, nk]: readonly [number, number, number], spacing: readonly [number, number, number]): void {
  const longest = Math.max(ni, nj, nk);
  const line = new Float64Array(longest);
  const vertex = new Int32Array(longest);
  const bound = new Float64Array(longest + 1);
  const pass = (count: number, stride: number, mm: number, start: number): void => {
    for (let q = 0; q < count; q++) line[q] = f[start + q * stride]!;
    const weight = mm * mm;
    let top = 0;
    vertex[0] = 0;
    bound[0] = -Infinity;
    bound[1] = Infinity;
    for (let q = 1; q < count; q++) {
      let cross = crossing(line, weight, q, vertex[top]!);
      while (cross <= bound[top]!) cross = crossing(line, weight, q, vertex[--top]!);
      vertex[++top] = q;
      bound[top] = cross;
      bound[top + 1] = Infinity;
    }
    top = 0;
    for (let q = 0; q < count; q++) {
      while (bound[top + 1]! < q) top += 1;
      const v = vertex[top]!;
      f[start + q * stride] = Math.min(FAR, weight * (q - v) ** 2 + line[v]!);
    }
  };
  for (let k = 0; k < nk; k++) for (let j = 0; j < nj; j++) pass(ni, 1, spacing[0], (k * nj + j) * ni);
  for (let k = 0; k < nk; k++) for (let i = 0; i < ni; i++) pass(nj, ni, spacing[1], k * nj * ni + i);
  for (let j = 0; j < nj; j++) for (let i = 0; i < ni; i++) pass(nk, ni * nj, spacing[2], j * ni + i);
}

/** Returns where the parabolas over q and v meet. */
function crossing(line: Float64Array, weight: number, q: number, v: number): number {
  return (line[q]! - line[v]! + weight * (q * q - v * v)) / (2 * weight * (q - v));
}

type Corner = [number, number, number];

function extent(blood: Uint8Array, [ni, nj, nk]: readonly [number, number, number]): { low: Corner; high: Corner } {
  const low: Corner = [ni, nj, nk];
  const high: Corner = [-1, -1, -1];
  for (let k = 0, at = 0; k < nk; k++) {
    for (let j = 0; j < nj; j++) {
      for (let i = 0; i < ni; i++) {
        if (blood[at++] === 0) continue;
        low[0] = Math.min(low[0], i); high[0] = Math.max(high[0], i);
        low[1] = Math.min(low[1], j); high[1] = Math.max(high[1], j);
        low[2] = Math.min(low[2], k); high[2] = Math.max(high[2], k);
      }
    }
  }
  return { low, high };
}

/** What is returned where nothing is known. */
export const UNKNOWN = Infinity;

/**
 * Returns the signed distance at a point of `ct`, mm, between the voxels' centres in proportion; UNKNOWN outside the
 * extent of the heart. Allocates nothing.
 */
export function distanceAt(field: DistanceField, x: number, y: number, z: number): number {
  const { voxelFromCt: m, size, low, high, mm } = field;
  const i = m[0]! * x + m[1]! * y + m[2]! * z + m[3]!;
  const j = m[4]! * x + m[5]! * y + m[6]! * z + m[7]!;
  const k = m[8]! * x + m[9]! * y + m[10]! * z + m[11]!;
  if (!(i >= low[0] && i <= high[0] && j >= low[1] && j <= high[1] && k >= low[2] && k <= high[2])) return UNKNOWN;
  const i0 = Math.min(Math.floor(i), Math.max(0, size[0] - 2));
  const j0 = Math.min(Math.floor(j), Math.max(0, size[1] - 2));
  const k0 = Math.min(Math.floor(k), Math.max(0, size[2] - 2));
  const a = i - i0, b = j - j0, c = k - k0;
  const di = size[0] > 1 ? 1 : 0;
  const dj = size[1] > 1 ? size[0] : 0;
  const dk = size[2] > 1 ? size[0] * size[1] : 0;
  const at = (k0 * size[1] + j0) * size[0] + i0;
  const near = between(mm, at, di, dj, a, b);
  return near + c * (between(mm, at + dk, di, dj, a, b) - near);
}

function between(mm: Float32Array, at: number, di: number, dj: number, a: number, b: number): number {
  const low = mm[at]! + a * (mm[at + di]! - mm[at]!);
  const high = mm[at + dj]! + a * (mm[at + dj + di]! - mm[at + dj]!);
  return low + b * (high - low);
}
