/** The heart (and a drawn chest) as an X-ray arm sees them: optical depth, worked out again only when the arm turns. */

import {
  ClampToEdgeWrapping, Data3DTexture, HalfFloatType, LinearFilter, Matrix4, NoColorSpace, RedFormat, UnsignedByteType, Vector2, Vector3,
  WebGLRenderTarget,
} from "three";
import type { RawShaderMaterial, Texture, WebGLRenderer } from "three";
import type { AcousticVolume } from "../ultrasound";
import { makePass, Offscreen } from "../ultrasound/passes";
import type { Uniforms } from "../ultrasound/passes";
import type { ArmAxes } from "./arms";
import { DETECTOR_MM, SOURCE_DETECTOR_MM, SOURCE_ISOCENTRE_MM } from "./arms";
import { MARCH } from "./shaders";
import type { BloodSummary } from "./tissue";
import { attenuationTable, BONE_PER_MM, LUNG_PER_MM, SOFT_PER_MM, summarise } from "./tissue";

const MOST_PER_MM = 0.05;
/** To each side of the isocentre: beyond it all is taken for lung. */
const REACH_MM = 118;
/** At once while the arm turns, and when it rests: pixels along a side, steps along a ray. */
const COARSE = { pixels: 112, steps: 40 } as const;
const FINE = { pixels: 256, steps: 112 } as const;
/** The fine picture is made in strips, one a frame, so that no frame waits for it. */
const STRIPS = 16;
const REST_MS = 180;
/** The patient's midline is to the right of the blood's centre, and the spine behind the left atrium, mm. */
const MIDLINE_MM = 19;
const BEHIND_MM = 34;

/** What all arms share: the tissue as a texture, and where the chest is. */
export class XrayField {
  readonly isocentre = new Vector3();
  readonly uniforms: Uniforms = {
    tissue: { value: null }, voxelFromCt: { value: new Matrix4() }, voxels: { value: new Vector3(1, 1, 1) }, centre: { value: this.isocentre },
    spine: { value: new Vector3() }, lowest: { value: 0 }, chest: { value: 1 }, mostPerMm: { value: MOST_PER_MM },
    lungPerMm: { value: LUNG_PER_MM }, softPerMm: { value: SOFT_PER_MM }, bonePerMm: { value: BONE_PER_MM },
    detector: { value: DETECTOR_MM }, distance_: { value: SOURCE_DETECTOR_MM }, reach: { value: REACH_MM },
  };
  private texture = tissueTexture(new Uint8Array(1), [1, 1, 1]);

  constructor() {
    this.uniforms.tissue!.value = this.texture;
  }

  /** Takes a heart's acoustic volume; null: the chest alone, around a point in `ct`, mm. */
  take(volume: AcousticVolume | null, otherwise: Vector3): void {
    this.texture.dispose();
    if (volume === null) {
      this.texture = tissueTexture(new Uint8Array(1), [1, 1, 1]);
      this.isocentre.copy(otherwise);
      this.lay({ centre: [otherwise.x, otherwise.y, otherwise.z], posteriorMm: otherwise.y + 42, lowestMm: otherwise.z - 50, hasBone: false });
    } else {
      const rgba = volume.texture.image.data as Uint8Array;
      const table = attenuationTable().map((perMm) => Math.round((255 * perMm) / MOST_PER_MM));
      const bytes = new Uint8Array(rgba.length / 4);
      for (let i = 0; i < bytes.length; i++) bytes[i] = table[rgba[4 * i]!]!;
      this.texture = tissueTexture(bytes, volume.size);
      (this.uniforms.voxelFromCt!.value as Matrix4).copy(volume.voxelFromCt);
      const summary = summarise(rgba, volume.size, new Matrix4().copy(volume.voxelFromCt).invert().elements);
      this.isocentre.set(...summary.centre);
      this.lay(summary);
    }
    this.uniforms.tissue!.value = this.texture;
    (this.uniforms.voxels!.value as Vector3).set(...(volume?.size ?? [1, 1, 1]));
  }

  dispose(): void {
    this.texture.dispose();
  }

  private lay({ centre, posteriorMm, lowestMm, hasBone }: BloodSummary): void {
    (this.uniforms.spine!.value as Vector3).set(centre[0] - MIDLINE_MM, posteriorMm + BEHIND_MM, centre[2]);
    this.uniforms.lowest!.value = lowestMm;
    this.uniforms.chest!.value = hasBone ? 0 : 1; // a volume from CT brings its own bones
  }
}

function tissueTexture(bytes: Uint8Array<ArrayBuffer>, [i, j, k]: readonly [number, number, number]): Data3DTexture {
  const texture = new Data3DTexture(bytes, i, j, k);
  texture.format = RedFormat;
  texture.type = UnsignedByteType;
  texture.colorSpace = NoColorSpace;
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.wrapS = texture.wrapT = texture.wrapR = ClampToEdgeWrapping;
  texture.unpackAlignment = 1;
  texture.needsUpdate = true;
  return texture;
}

/** One arm's picture of a field. */
export class XrayImage {
  /** Pictures made so far, coarse and fine. */
  made = 0;
  private readonly offscreen: Offscreen;
  private readonly coarse = makeTarget(COARSE.pixels);
  private readonly fine = makeTarget(FINE.pixels);
  private readonly pass: RawShaderMaterial;
  private readonly own: Uniforms;
  private readonly source = new Vector3();
  private turned = true;
  private turnedMs = -Infinity;
  /** Strips of the fine picture that are there; STRIPS: all. */
  private strips = 0;

  constructor(renderer: WebGLRenderer, private readonly field: XrayField, private readonly axes: ArmAxes) {
    this.offscreen = new Offscreen(renderer);
    this.own = {
      source: { value: this.source }, along: { value: axes.beam }, right: { value: axes.right }, up: { value: axes.up },
      size: { value: new Vector2() }, steps: { value: 1 },
    };
    this.pass = makePass(MARCH, { ...field.uniforms, ...this.own });
  }

  /** The optical depth, beyond that of lung. */
  get texture(): Texture {
    return this.strips === STRIPS ? this.fine.texture : this.coarse.texture;
  }

  /** For tests: the target that `texture` belongs to. */
  get target(): WebGLRenderTarget {
    return this.strips === STRIPS ? this.fine : this.coarse;
  }

  /** Says that the arm, or the heart, has changed. */
  turn(): void {
    this.turned = true;
  }

  /** Works out what is due, a little at a time; returns whether the picture is another one now. */
  update(nowMs: number): boolean {
    if (this.turned) {
      this.turned = false;
      this.turnedMs = nowMs;
      this.strips = 0;
      this.source.copy(this.field.isocentre).addScaledVector(this.axes.beam, -SOURCE_ISOCENTRE_MM);
      this.march(this.coarse, COARSE.steps);
      this.made += 1;
      return true;
    }
    if (this.strips === STRIPS || nowMs - this.turnedMs < REST_MS) return false;
    const high = FINE.pixels / STRIPS;
    this.fine.scissor.set(0, this.strips * high, FINE.pixels, high);
    this.march(this.fine, FINE.steps);
    this.strips += 1;
    if (this.strips < STRIPS) return false;
    this.made += 1;
    return true;
  }

  dispose(): void {
    this.coarse.dispose();
    this.fine.dispose();
    this.pass.dispose();
    this.offscreen.dispose();
  }

  private march(target: WebGLRenderTarget, steps: number): void {
    (this.own.size!.value as Vector2).set(target.width, target.height);
    this.own.steps!.value = steps;
    this.offscreen.begin();
    this.offscreen.draw(this.pass, target);
    this.offscreen.end();
  }
}

function makeTarget(pixels: number): WebGLRenderTarget {
  const target = new WebGLRenderTarget(pixels, pixels, {
    format: RedFormat, type: HalfFloatType, internalFormat: "R16F", colorSpace: NoColorSpace, depthBuffer: false, generateMipmaps: false,
  });
  target.texture.minFilter = target.texture.magFilter = LinearFilter;
  target.scissorTest = true;
  return target;
}
