/** The heart's volumes, fetched from the server: acoustic properties and labels. */

import type { AcousticDescription, SceneDescription, ScaleDescription } from "../generated/messages";
import { AcousticVolume } from "../ultrasound/volume";
import { ACOUSTIC_SCALES } from "../ultrasound/volume";
import type { AcousticScales } from "../ultrasound/volume";
import { LabelVolume } from "../ultrasound/labels";

/** The label volume as bytes, for whoever computes with it. */
export interface RawLabels {
  /** A label at every voxel, i fastest; 0: nothing. There is nothing all around the outside. */
  readonly bytes: Uint8Array<ArrayBuffer>;
  /** Voxels along i, j, k. */
  readonly size: readonly [number, number, number];
  /** 16 numbers row by row: (i, j, k, 1) of a voxel's centre to mm in `ct`. */
  readonly ctFromVoxel: readonly number[];
  /** The labels that are blood, where a catheter may be; all others are walls. */
  readonly blood: ReadonlySet<number>;
}

/** Returns the acoustic volume of a scene; null where it has none. Throws Error with a sentence when it cannot be had. */
export async function loadAcoustic(scene: SceneDescription, sceneUrl: string): Promise<AcousticVolume | null> {
  const told = scene.heart?.acoustic ?? null;
  if (told === null) return null;
  const bytes = await fetched(told.file, sceneUrl, 4 * voxels(told.size), "acoustic volume");
  return new AcousticVolume(bytes, told.size, told.ct_from_voxel, acousticScales(told));
}

/** Returns the labels of a scene as a texture with their colours; null and Error as `loadAcoustic`. */
export async function loadLabels(scene: SceneDescription, sceneUrl: string): Promise<LabelVolume | null> {
  const told = scene.heart?.labels ?? null;
  const raw = await loadRawLabels(scene, sceneUrl);
  if (told === null || raw === null) return null;
  return new LabelVolume(raw.bytes, raw.size, raw.ctFromVoxel, new Map(told.values.map(({ value, colour }) => [value, colour])));
}

/** Returns the labels of a scene as bytes; null and Error as `loadAcoustic`. Asked again, the browser has them kept. */
export async function loadRawLabels(scene: SceneDescription, sceneUrl: string): Promise<RawLabels | null> {
  const told = scene.heart?.labels ?? null;
  if (told === null) return null;
  return {
    bytes: await fetched(told.file, sceneUrl, voxels(told.size), "label volume"),
    size: told.size,
    ctFromVoxel: told.ct_from_voxel,
    blood: new Set(told.values.filter((each) => each.is_blood).map((each) => each.value)),
  };
}

/** Returns the scales as the shader takes them. Throws Error when a channel is coded otherwise. */
export function acousticScales(told: AcousticDescription): AcousticScales {
  const highest = (name: "scatter" | "attenuation" | "interface"): number => {
    const scale: ScaleDescription = told[name];
    if (scale.curve !== "square") throw new Error(`The acoustic volume's ${name} is coded in a way that this page does not know.`);
    return scale.high;
  };
  return {
    ...ACOUSTIC_SCALES,
    scatterMax: highest("scatter"),
    attenuationMaxDbCmMHz: highest("attenuation"),
    interfaceMaxPerMm: highest("interface"),
  };
}

function voxels([i, j, k]: readonly [number, number, number]): number {
  return i * j * k;
}

async function fetched(file: string, sceneUrl: string, length: number, what: string): Promise<Uint8Array<ArrayBuffer>> {
  let bytes: Uint8Array<ArrayBuffer>;
  try {
    const response = await fetch(new URL(file, sceneUrl)); // the server packs it, the browser unpacks it
    if (!response.ok) throw new Error(`status ${response.status}`);
    bytes = new Uint8Array(await response.arrayBuffer());
  } catch (error) {
    throw new Error(`The ${what} could not be loaded (${error instanceof Error ? error.message : "no answer"}).`);
  }
  if (bytes.length !== length) throw new Error(`The ${what} should have ${length} bytes and has ${bytes.length}.`);
  return bytes;
}
