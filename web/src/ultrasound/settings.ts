/** What the user of the ultrasound machine sets, and what follows from it; src/cathxr/ultrasound/settings.py is its twin. */

export interface IceSettings {
  /** The whole sector, rad. */
  readonly sectorRad: number;
  /** From the transducer's face, mm. */
  readonly depthMm: number;
  readonly frequencyMHz: number;
  readonly gainDb: number;
  /** Amplification with depth, for the way there and back. */
  readonly tgcSlopeDbCmMHz: number;
  /** The eight sliders, equally spaced from the face to the depth. */
  readonly tgcDb: readonly number[];
  readonly dynamicRangeDb: number;
  /** Speckle of myocardium relative to a perfect plane reflector. */
  readonly myocardiumDb: number;
  /** The echo that is white at gain 0. */
  readonly whiteDb: number;
  readonly noiseDb: number;
  readonly ringDb: number;
  /** n of cosⁿ in a wall's echo. */
  readonly incidencePower: number;
  /** How far behind the face the lines meet. */
  readonly apexMm: number;
  /** Length of the array, which sets the beam's width. */
  readonly apertureMm: number;
  /** 1, or 3 for the beam's thickness across the image plane. */
  readonly slices: 1 | 3;
}

/** Lines and samples of the polar image, and of the coarser march of losses. */
export interface IceSize {
  readonly lines: number;
  readonly samples: number;
  readonly lossLines: number;
  readonly lossSamples: number;
}

export const ICE_SIZE: IceSize = { lines: 192, samples: 448, lossLines: 96, lossSamples: 64 };

export const ICE_DEFAULTS: IceSettings = {
  sectorRad: Math.PI / 2,
  depthMm: 90,
  frequencyMHz: 7.5,
  gainDb: 0,
  tgcSlopeDbCmMHz: 0.4,
  tgcDb: [0, 0, 0, 0, 0, 0, 0, 0],
  dynamicRangeDb: 50,
  myocardiumDb: -50,
  whiteDb: -25,
  noiseDb: -102,
  ringDb: -14,
  incidencePower: 3,
  apexMm: 3,
  apertureMm: 7,
  slices: 3,
};

/** A point spread function never reaches further than this many samples or lines to a side. */
export const LARGEST_RADIUS = 15;
const SOUND_MM_US = 1.54;
const FWHM = 2.3548200450309493;
const CORRELATION = 0.6198;
/** How many layers of scatterers across the image plane add up to a speckle, by the number of slices. */
const ELEVATION_LAYERS = { 1: 1, 3: 4 } as const;

export interface Resolved {
  readonly lineRad: number;
  readonly sampleMm: number;
  readonly sigmaLateralRad: number;
  readonly sigmaAxialMm: number;
  readonly cellMm: number;
  readonly layers: number;
  readonly correlationMm: number;
  /** Standard deviation of a wall's line. */
  readonly wallMm: number;
  /** Weights from the middle outwards, not normalised, then zeros up to LARGEST_RADIUS. */
  readonly lateral: Float32Array;
  readonly axial: Float32Array;
  readonly lateralRadius: number;
  readonly axialRadius: number;
}

/** Returns what follows from the settings. Throws RangeError when a value is out of its range. */
export function resolve(settings: IceSettings, size: IceSize): Resolved {
  check(settings);
  const wavelength = SOUND_MM_US / settings.frequencyMHz;
  const lineRad = settings.sectorRad / size.lines;
  const sampleMm = settings.depthMm / size.samples;
  const sigmaLateralRad = Math.max((0.9 * wavelength) / settings.apertureMm / FWHM, 0.7 * lineRad);
  const sigmaAxialMm = Math.max((1.5 * wavelength) / FWHM, 0.7 * sampleMm);
  const cellMm = Math.max(1.5 * sigmaAxialMm, sampleMm);
  const [lateral, lateralRadius] = weights(sigmaLateralRad / lineRad);
  const [axial, axialRadius] = weights(sigmaAxialMm / sampleMm);
  return {
    lineRad, sampleMm, sigmaLateralRad, sigmaAxialMm, cellMm, layers: ELEVATION_LAYERS[settings.slices], correlationMm: CORRELATION * cellMm,
    wallMm: Math.max(0.45, 1.2 * sampleMm),
    lateral, axial, lateralRadius, axialRadius,
  };
}

function weights(sigma: number): [Float32Array, number] {
  const radius = Math.min(LARGEST_RADIUS, Math.ceil(3 * sigma));
  const out = new Float32Array(LARGEST_RADIUS + 1);
  for (let i = 0; i <= radius; i++) out[i] = Math.exp(-0.5 * (i / sigma) ** 2);
  return [out, radius];
}

const LIMITS: readonly (readonly [keyof IceSettings, number, number])[] = [
  ["sectorRad", 0.1, Math.PI],
  ["depthMm", 10, 300],
  ["frequencyMHz", 1, 20],
  ["dynamicRangeDb", 20, 120],
  ["incidencePower", 1, 16],
  ["apexMm", 0.5, 100],
  ["apertureMm", 1, 30],
  ["gainDb", -100, 100],
];

function check(settings: IceSettings): void {
  for (const [name, low, high] of LIMITS) {
    const value = settings[name] as number;
    if (!(value >= low && value <= high)) throw new RangeError(`${name}: expected ${low} to ${high}, got ${value}`);
  }
  if (settings.tgcDb.length !== 8) throw new RangeError(`tgcDb: expected 8 numbers, got ${settings.tgcDb.length}`);
}

/** Returns how many pictures a second an address such as `?iceHz=5` asks for; 30 when it says nothing. */
export function iceHzFrom(query: string): number {
  const given = Number(new URLSearchParams(query).get("iceHz") ?? "30");
  return Number.isFinite(given) ? Math.min(60, Math.max(0, given)) : 30;
}
