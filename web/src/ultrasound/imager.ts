/** The simulated ultrasound picture: four passes on the graphics card, some 30 times a second, whatever the headset's rate. */

import {
  ClampToEdgeWrapping, HalfFloatType, LinearFilter, Matrix4, NearestFilter, NoColorSpace, NormalBlending, RedFormat, RGBAFormat, RGFormat,
  UnsignedByteType, Vector2, Vector3, WebGLRenderTarget,
} from "three";
import type { RawShaderMaterial, Texture, WebGLRenderer } from "three";
import { makePass, Offscreen } from "./passes";
import type { Uniforms } from "./passes";
import type { IceSettings, IceSize, Resolved } from "./settings";
import { ICE_DEFAULTS, ICE_SIZE, resolve } from "./settings";
import { AXIAL, ECHO, LOSS, RECEIVE } from "./shaders";
import type { AcousticVolume } from "./volume";

/** Echoes are stored times this: half floats hold 6e-8 to 65504, echoes are 1e-7 to 1. */
const ECHO_SCALE = 4096;
/** Width of a Gaussian by its area, in standard deviations. */
const SLOPE = Math.sqrt(2 * Math.PI);

export class IceImager {
  /** Pictures made so far: the number of the one shown is one less. */
  made = 0;
  frozen = false;
  /** Share of the pictures before in each new one, 0 to 0.9, as scanners have it: calms the noise, and lags a little. */
  persistence = 0.3;
  private current: IceSettings = ICE_DEFAULTS;
  private worked!: Resolved;
  private volume: AcousticVolume | null = null;
  private posed = false;
  private lastS = -Infinity;
  private readonly ctFromTransducer = new Matrix4();
  private readonly voxelFromTransducer = new Matrix4();
  private readonly offscreen: Offscreen;
  private readonly lossTarget: WebGLRenderTarget;
  private readonly echoTarget: WebGLRenderTarget;
  private readonly axialTarget: WebGLRenderTarget;
  private readonly greyTarget: WebGLRenderTarget;
  private readonly shared: Uniforms = {
    volume: { value: null },
    origin: { value: new Vector3() }, axisX: { value: new Vector3() }, axisY: { value: new Vector3() },
    axisZ: { value: new Vector3() }, spacing: { value: new Vector3() }, voxels: { value: new Vector3() },
    ctPerMm: { value: 1 }, sector: { value: 1 }, depth: { value: 1 }, apex: { value: 1 },
    interfaceMm: { value: 1 }, scatterMax: { value: 1 }, attenuationMax: { value: 1 }, interfaceMax: { value: 1 },
    frequency: { value: 1 }, incidencePower: { value: 1 }, cellMm: { value: 1 }, correlationMm: { value: 1 },
    sigmaAxialMm: { value: 1 }, sigmaLateralRad: { value: 1 }, myocardium: { value: 1 }, slices: { value: 1 }, layers: { value: 1 },
    echoScale: { value: ECHO_SCALE }, narrowing: { value: 1 }, wallGain: { value: 1 },
    noise: { value: 0 }, ring: { value: 0 }, gainDb: { value: 0 }, tgcTotalDb: { value: 0 }, whiteDb: { value: 0 },
    dynamicRangeDb: { value: 1 }, tgc: { value: new Float32Array(8) }, seq: { value: 0 },
    fresh: { value: 1 },
  };
  private readonly loss: RawShaderMaterial;
  private readonly echo: RawShaderMaterial;
  private readonly axial: RawShaderMaterial;
  private readonly receive: RawShaderMaterial;

  /** hz: pictures a second at most. Throws Error when the browser cannot draw into half-float pictures. */
  constructor(renderer: WebGLRenderer, public hz = 30, readonly size: IceSize = ICE_SIZE) {
    const gl = renderer.getContext();
    if (gl.getExtension("EXT_color_buffer_float") === null && gl.getExtension("EXT_color_buffer_half_float") === null) {
      throw new Error("This browser's graphics cannot draw into half-float pictures, which the ultrasound image needs.");
    }
    this.offscreen = new Offscreen(renderer);
    this.lossTarget = makeTarget(size.lossLines, size.lossSamples, "R16F");
    this.echoTarget = makeTarget(size.lines, size.samples, "RG16F");
    this.axialTarget = makeTarget(size.lines, size.samples, "RG16F");
    this.greyTarget = makeTarget(size.lines, size.samples, "RGBA8");
    const fine = { value: new Vector2(size.lines, size.samples) };
    const { shared } = this;
    this.loss = makePass(LOSS, { ...shared, size: { value: new Vector2(size.lossLines, size.lossSamples) } });
    this.echo = makePass(ECHO, { ...shared, size: fine, loss: { value: this.lossTarget.texture } });
    this.axial = makePass(AXIAL, { ...blur(this.echoTarget), size: fine });
    this.receive = makePass(RECEIVE, { ...shared, ...blur(this.axialTarget), size: fine });
    this.receive.blending = NormalBlending;
    this.receive.transparent = true;
    this.setSettings({});
  }

  /** The polar picture: u is the line (0 the most proximal), v the depth, red the grey level as it is to be shown. */
  get texture(): Texture {
    return this.greyTarget.texture;
  }

  /** For tests: the target that `texture` belongs to. */
  get target(): WebGLRenderTarget {
    return this.greyTarget;
  }

  get settings(): IceSettings {
    return this.current;
  }

  get resolved(): Resolved {
    return this.worked;
  }

  get ready(): boolean {
    return this.volume !== null && this.posed;
  }

  /** Takes a volume; null: none. The old one is not disposed of. */
  setVolume(volume: AcousticVolume | null): void {
    this.volume = volume;
    const u = this.shared;
    u.volume!.value = volume?.texture ?? null;
    if (volume === null) return;
    (u.spacing!.value as Vector3).copy(volume.spacingMm);
    (u.voxels!.value as Vector3).set(...volume.size);
    u.interfaceMm!.value = volume.interfaceMm;
    u.scatterMax!.value = volume.scales.scatterMax;
    u.attenuationMax!.value = volume.scales.attenuationMaxDbCmMHz;
    u.interfaceMax!.value = volume.scales.interfaceMaxPerMm;
    if (this.posed) this.place();
  }

  /**
   * Takes the transducer's pose: origin in the middle of the array's face, z along the catheter (distal), x the beam's
   * direction; mm, maybe with a common scale. Cheap: nothing is drawn before `update`.
   */
  setPose(ctFromTransducer: Matrix4): void {
    this.ctFromTransducer.copy(ctFromTransducer);
    this.posed = true;
    if (this.volume !== null) this.place();
  }

  /** Changes some settings. Throws RangeError when one is out of its range; then none is changed. */
  setSettings(change: Partial<IceSettings>): void {
    const next = { ...this.current, ...change };
    this.worked = resolve(next, this.size);
    this.current = next;
    const u = this.shared;
    const numbers: Record<string, number> = {
      sector: next.sectorRad, depth: next.depthMm, apex: next.apexMm, frequency: next.frequencyMHz,
      incidencePower: next.incidencePower, cellMm: this.worked.cellMm, correlationMm: this.worked.correlationMm,
      sigmaAxialMm: this.worked.sigmaAxialMm, sigmaLateralRad: this.worked.sigmaLateralRad, slices: next.slices, layers: this.worked.layers,
      myocardium: 10 ** (next.myocardiumDb / 20), noise: 10 ** (next.noiseDb / 20), ring: 10 ** (next.ringDb / 20),
      gainDb: next.gainDb, whiteDb: next.whiteDb, dynamicRangeDb: next.dynamicRangeDb,
      tgcTotalDb: (next.tgcSlopeDbCmMHz * next.frequencyMHz * next.depthMm) / 10,
    };
    for (const name in numbers) u[name]!.value = numbers[name];
    (u.tgc!.value as Float32Array).set(next.tgcDb);
    setBlur(this.axial, this.worked.axial, this.worked.axialRadius);
    setBlur(this.receive, this.worked.lateral, this.worked.lateralRadius);
    if (this.ready) this.place();
  }

  /** Makes a picture if one is due; returns whether it did. nowS: any clock's seconds. Call it before the scene is drawn. */
  update(nowS: number): boolean {
    if (this.frozen || !this.ready || this.hz <= 0 || nowS - this.lastS < 1 / this.hz - 0.002) return false;
    const pause = nowS - this.lastS;
    this.lastS = nowS;
    this.make(this.made, pause > 1 ? 0 : this.persistence);
    return true;
  }

  /** Makes a picture now. seq: its number, which only the receiver's noise depends on. persistence: see there. */
  make(seq = this.made, persistence = 0): void {
    if (!this.ready) return;
    this.shared.seq!.value = seq;
    this.shared.fresh!.value = this.made === 0 ? 1 : 1 - Math.min(0.9, Math.max(0, persistence));
    this.offscreen.begin();
    this.offscreen.draw(this.loss, this.lossTarget);
    this.offscreen.draw(this.echo, this.echoTarget);
    this.offscreen.draw(this.axial, this.axialTarget);
    this.offscreen.draw(this.receive, this.greyTarget);
    this.offscreen.end();
    this.made += 1;
  }

  dispose(): void {
    for (const target of [this.lossTarget, this.echoTarget, this.axialTarget, this.greyTarget]) target.dispose();
    for (const pass of [this.loss, this.echo, this.axial, this.receive]) pass.dispose();
    this.offscreen.dispose();
  }

  private place(): void {
    const u = this.shared;
    const matrix = this.voxelFromTransducer.multiplyMatrices(this.volume!.voxelFromCt, this.ctFromTransducer);
    (u.origin!.value as Vector3).setFromMatrixPosition(matrix);
    (u.axisX!.value as Vector3).setFromMatrixColumn(matrix, 0);
    (u.axisY!.value as Vector3).setFromMatrixColumn(matrix, 1);
    (u.axisZ!.value as Vector3).setFromMatrixColumn(matrix, 2);
    const e = this.ctFromTransducer.elements;
    const ctPerMm = Math.hypot(e[0]!, e[1]!, e[2]!);
    u.ctPerMm!.value = ctPerMm;
    const slopeMm = this.volume!.interfaceMm / SLOPE / ctPerMm;
    const lineMm = Math.min(this.worked.wallMm, slopeMm);
    u.narrowing!.value = slopeMm / lineMm;
    u.wallGain!.value = Math.hypot(1, this.worked.sigmaAxialMm / lineMm);
  }
}

function makeTarget(width: number, height: number, kind: "R16F" | "RG16F" | "RGBA8"): WebGLRenderTarget {
  const target = new WebGLRenderTarget(width, height, {
    format: kind === "R16F" ? RedFormat : kind === "RG16F" ? RGFormat : RGBAFormat,
    type: kind === "RGBA8" ? UnsignedByteType : HalfFloatType,
    internalFormat: kind,
    colorSpace: NoColorSpace,
    depthBuffer: false,
    generateMipmaps: false,
    wrapS: ClampToEdgeWrapping,
    wrapT: ClampToEdgeWrapping,
  });
  target.texture.minFilter = target.texture.magFilter = kind === "RG16F" ? NearestFilter : LinearFilter;
  return target;
}

function blur(from: WebGLRenderTarget): Uniforms {
  return { echo: { value: from.texture }, weights: { value: new Float32Array(16) }, radius: { value: 0 } };
}

function setBlur(pass: RawShaderMaterial, weights: Float32Array, radius: number): void {
  (pass.uniforms.weights!.value as Float32Array).set(weights);
  pass.uniforms.radius!.value = radius;
}
