/** The sector as a mesh in mm of the frame `transducer`: for the beam in the scene and for the panel alike. */

import { BufferAttribute, BufferGeometry, DoubleSide, GLSL3, Matrix4, Mesh, RawShaderMaterial } from "three";
import type { IceImager } from "./imager";
import { LabelVolume } from "./labels";
import { FAN, FAN_VERTEX } from "./shaders";

const STEPS = 48;
const UNIT = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

/** The outline of a sector, in the x-z plane; the shader cuts its far edge round. Rewritten in place. */
export class FanGeometry extends BufferGeometry {
  private readonly places = new BufferAttribute(new Float32Array(6 * (STEPS + 1)), 3);
  private readonly shape = { sectorRad: 0, depthMm: 0, apexMm: 0 };

  constructor() {
    super();
    const index: number[] = [];
    for (let i = 0; i < STEPS; i++) index.push(2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 2, 2 * i + 1, 2 * i + 3);
    this.setAttribute("position", this.places);
    this.setIndex(index);
  }

  /** Takes a sector (rad), a depth and the apex's distance behind the face (mm). */
  fit(sectorRad: number, depthMm: number, apexMm: number): void {
    const { shape } = this;
    if (sectorRad === shape.sectorRad && depthMm === shape.depthMm && apexMm === shape.apexMm) return;
    shape.sectorRad = sectorRad;
    shape.depthMm = depthMm;
    shape.apexMm = apexMm;
    const far = (apexMm + depthMm) / Math.cos(sectorRad / STEPS / 2);
    for (let i = 0; i <= STEPS; i++) {
      const angle = (i / STEPS - 0.5) * sectorRad;
      this.places.setXYZ(2 * i, apexMm * Math.cos(angle) - apexMm, 0, apexMm * Math.sin(angle));
      this.places.setXYZ(2 * i + 1, far * Math.cos(angle) - apexMm, 0, far * Math.sin(angle));
    }
    this.places.needsUpdate = true;
    this.computeBoundingSphere();
  }
}

/**
 * A sector that shows an imager's picture. Put it under a group whose frame is `transducer` in mm, or into the panel.
 * All of an imager's fans may share one geometry.
 */
export class IceFan extends Mesh<FanGeometry, RawShaderMaterial> {
  /** Bound while nothing is coloured: a shader must never see a texture of another type than it was written for. */
  private readonly unlabelled = new LabelVolume(new Uint8Array(1), [1, 1, 1], UNIT, new Map());
  private labels = this.unlabelled;

  constructor(private readonly imager: IceImager, geometry = new FanGeometry()) {
    const uniforms = {
      picture: { value: imager.texture }, palette: { value: null }, labels: { value: null },
      labelsFromTransducer: { value: new Matrix4() },
      sector: { value: 1 }, depth: { value: 1 }, apex: { value: 1 }, opacity: { value: 1 }, colouring: { value: 0 },
    };
    super(geometry, new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: FAN_VERTEX, fragmentShader: FAN, uniforms, side: DoubleSide, transparent: true,
      forceSinglePass: true, // flat: one draw call, not one for each side
    }));
    this.name = "ice fan";
    this.colour(null, 0);
    this.fit();
  }

  /** Follows the imager's settings: sector, depth. To be called when they have changed. */
  fit(): void {
    const { sectorRad, depthMm, apexMm } = this.imager.settings;
    this.geometry.fit(sectorRad, depthMm, apexMm);
    this.set("sector", sectorRad);
    this.set("depth", depthMm);
    this.set("apex", apexMm);
  }

  /** 0 to 1; of the black parts too: an ultrasound picture's blood is black, not clear. */
  set opacity(value: number) {
    this.set("opacity", value);
  }

  /** Colours what the plane cuts, for teaching: strength from 0 (off) to 1. Give the pose afterwards. */
  colour(labels: LabelVolume | null, strength: number): void {
    this.labels = labels ?? this.unlabelled;
    this.set("labels", this.labels.texture);
    this.set("palette", this.labels.palette);
    this.set("colouring", labels === null ? 0 : strength);
  }

  /** Takes the transducer's pose, which only the colours need; the same as the imager's. */
  setPose(ctFromTransducer: Matrix4): void {
    const matrix = this.material.uniforms.labelsFromTransducer!.value as Matrix4;
    matrix.multiplyMatrices(this.labels.voxelFromCt, ctFromTransducer);
  }

  override dispose(): void {
    this.geometry.dispose();
    this.material.dispose();
    this.unlabelled.dispose();
  }

  private set(name: string, value: unknown): void {
    this.material.uniforms[name]!.value = value;
  }
}
