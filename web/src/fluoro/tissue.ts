/** From the acoustic volume's impedance to what weakens X-rays: the one tissue property that both depend on is density. */

/** Scale of the channel R (docs/acoustic-volume.md): the same for every heart. */
const IMPEDANCE = { low: -4.6077, high: 4.545, centre: 1.6569, width: 0.03 } as const;
/** Impedance (MRayl) and attenuation at some 70 keV (1/mm): lung full of air, fat, blood, muscle, pericardium, bone. */
const KNOTS: readonly (readonly [mrayl: number, perMm: number])[] = [
  [0.37, 0.005],
  [1.31, 0.0172],
  [1.657, 0.0203],
  [1.731, 0.0206],
  [1.83, 0.021],
  [6.71, 0.047],
];
export const LUNG_PER_MM = KNOTS[0]![1];
export const SOFT_PER_MM = 0.0204;
export const BONE_PER_MM = KNOTS[KNOTS.length - 1]![1];

/** Returns the impedance that a code (0 to 255) stands for, MRayl. */
export function impedanceOf(code: number): number {
  const { low, high, centre, width } = IMPEDANCE;
  return centre * Math.exp(width * Math.sinh(low + (code / 255) * (high - low)));
}

/** Returns the attenuation at each of the 256 codes of impedance, 1/mm. */
export function attenuationTable(): Float32Array<ArrayBuffer> {
  const table = new Float32Array(256);
  for (let code = 0; code < 256; code++) {
    const mrayl = Math.log(impedanceOf(code));
    let at = 0;
    while (at < KNOTS.length - 2 && mrayl > Math.log(KNOTS[at + 1]![0])) at += 1;
    const [[lowZ, low], [highZ, high]] = [KNOTS[at]!, KNOTS[at + 1]!];
    const share = (mrayl - Math.log(lowZ)) / (Math.log(highZ) - Math.log(lowZ));
    table[code] = low + Math.min(1, Math.max(0, share)) * (high - low);
  }
  return table;
}

/** Where the blood is, in `ct` mm, and whether the volume holds bone: what the drawn chest is laid around. */
export interface BloodSummary {
  readonly centre: readonly [number, number, number];
  /** The most posterior and the lowest of it, but for a few outliers. */
  readonly posteriorMm: number;
  readonly lowestMm: number;
  readonly hasBone: boolean;
}

/** Returns a summary of an acoustic volume. rgba: (K, J, I, 4), i fastest; ctFromVoxel: 16 numbers, column by column. */
export function summarise(rgba: ArrayLike<number>, size: readonly [number, number, number], ctFromVoxel: ArrayLike<number>): BloodSummary {
  const [sizeI, sizeJ, sizeK] = size;
  const e = ctFromVoxel;
  const ys: number[] = [];
  const zs: number[] = [];
  let [x, y, z, bone, seen] = [0, 0, 0, 0, 0];
  const step = 2; // every eighth voxel: a sum over a hundred thousand is good to a tenth of a millimetre
  for (let k = 0; k < sizeK; k += step) for (let j = 0; j < sizeJ; j += step) for (let i = 0; i < sizeI; i += step) {
    const at = 4 * (i + sizeI * (j + sizeJ * k));
    seen += 1;
    if (rgba[at]! > 215) bone += 1;
    if (rgba[at + 1]! > 62 || rgba[at]! < 100) continue; // scatters far less than muscle: blood
    const py = e[1]! * i + e[5]! * j + e[9]! * k + e[13]!;
    const pz = e[2]! * i + e[6]! * j + e[10]! * k + e[14]!;
    x += e[0]! * i + e[4]! * j + e[8]! * k + e[12]!;
    y += py;
    z += pz;
    ys.push(py);
    zs.push(pz);
  }
  const count = Math.max(1, ys.length);
  ys.sort((a, b) => a - b);
  zs.sort((a, b) => a - b);
  return {
    centre: [x / count, y / count, z / count],
    posteriorMm: ys[Math.floor(0.98 * (ys.length - 1))] ?? 0,
    lowestMm: zs[Math.floor(0.02 * (zs.length - 1))] ?? 0,
    hasBone: bone > 0.002 * seen,
  };
}
