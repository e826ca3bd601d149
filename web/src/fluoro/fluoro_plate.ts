/** One X-ray arm's picture as a plate: the still heart, and the catheter drawn anew for every frame. */

import {
  AddEquation, BufferGeometry, CustomBlending, CylinderGeometry, DoubleSide, GLSL3, Group, Matrix4, Mesh, MeshBasicMaterial, PlaneGeometry,
  Quaternion, RawShaderMaterial, SrcColorFactor, Vector3, ZeroFactor,
} from "three";
import type { WebGLRenderer } from "three";
import type { Plate, PointerPhase } from "../flat/plate";
import { ARRAY_BEHIND_TIP_MM } from "../ice/transducer";
import type { DrawnTrack } from "../motion/drawn";
import type { ArmAngles } from "../stage/settings";
import { ArmAxes, pictureFromCt, sameArm, SOURCE_ISOCENTRE_MM } from "./arms";
import { FluoroOverlay, presetAt } from "./overlay";
import { CATHETER, CATHETER_VERTEX, PICTURE, PICTURE_VERTEX } from "./shaders";
import type { XrayField } from "./xray";
import { XrayImage } from "./xray";

const SIDE_M = 0.4;
/** How grey a millimetre of tissue makes the picture: a display's window, not physics. */
const CONTRAST = 0.52;
/** Pictures a second of a pulsed tube: the grain changes as often, while anything does. */
const PULSES_HZ = 15;
const ORDER = 60;
/** The catheter goes on beyond the inlet, straight, as far as the picture's edge. */
const BEYOND_MM = 160;
const DEGREES_PER_PLATE = 120;

export class FluoroPlate implements Plate {
  readonly group = new Group();
  readonly widthM = SIDE_M;
  readonly heightM = SIDE_M;
  readonly axes = new ArmAxes();
  readonly image: XrayImage;
  /** box to picture: x and y over w from -1 to 1. For tests, too. */
  readonly pictureFromBox = new Matrix4();
  /** Told when a pointer turns the arm. */
  onTurn: (angles: ArmAngles) => void = () => undefined;
  textScale = 1;
  /** Whether the presets stand on the picture: where the page's controls are not beside it. */
  buttons = false;
  angles: ArmAngles = { laoDeg: 0, cranialDeg: 0 };
  private readonly overlay = new FluoroOverlay();
  private readonly told = { name: "", angles: this.angles, message: "?", ghost: false, textScale: 1, buttons: false };
  private readonly picture: RawShaderMaterial;
  private readonly tube: Mesh<BufferGeometry, RawShaderMaterial>;
  private readonly beyond: Mesh<CylinderGeometry, RawShaderMaterial>;
  private readonly parts: Mesh[];
  private readonly sourceBox = new Vector3();
  private readonly boxFromCt = new Matrix4();
  private readonly pictureFromCt = new Matrix4();
  private readonly entry = new Vector3();
  private readonly back = new Vector3();
  private readonly turn = new Quaternion();
  private readonly size = new Vector3();
  private readonly from = { u: 0, v: 0, angles: this.angles, held: false };

  /** geometry: the drawn catheter's own surface, mm in `box`. */
  constructor(readonly title: string, renderer: WebGLRenderer, private readonly field: XrayField, geometry: BufferGeometry) {
    this.image = new XrayImage(renderer, field, this.axes);
    const square = new PlaneGeometry(SIDE_M, SIDE_M);
    this.picture = new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: PICTURE_VERTEX, fragmentShader: PICTURE,
      uniforms: {
        depth: { value: this.image.texture }, contrast: { value: CONTRAST }, brightness: { value: 0.93 }, grain: { value: 0.05 }, seed: { value: 0 },
      },
    });
    this.tube = new Mesh(geometry, this.catheterMaterial(0));
    this.beyond = new Mesh(new CylinderGeometry(1, 1, 1, 12, 1, true), this.catheterMaterial(1));
    const text = new Mesh(square, new MeshBasicMaterial({ map: this.overlay.texture, transparent: true, depthWrite: false }));
    this.parts = [new Mesh(square, this.picture), this.tube, this.beyond, text];
    for (const [at, part] of this.parts.entries()) {
      part.renderOrder = ORDER + at;
      part.position.z = 0.0006 * at;
      part.frustumCulled = false;
    }
    this.group.name = title;
    this.group.add(...this.parts);
    this.fit({ laoDeg: 0, cranialDeg: 0 }, true);
  }

  /** Takes where the heart is: after the field has taken another one. */
  place(ctFromBox: Matrix4): void {
    this.boxFromCt.copy(ctFromBox).invert();
    this.fit(this.angles, true);
  }

  /** Takes the catheter's radius, mm. */
  set radiusMm(radius: number) {
    this.size.set(radius, BEYOND_MM, radius);
  }

  /** Turns the arm. */
  fit(angles: ArmAngles, anyway = false): void {
    if (!anyway && sameArm(angles, this.angles)) return;
    this.angles = angles;
    this.axes.set(angles);
    pictureFromCt(this.pictureFromCt, this.axes, this.field.isocentre);
    const ctFromBox = this.pictureFromBox.copy(this.boxFromCt).invert();
    ctFromBox.premultiply(this.pictureFromCt);
    this.sourceBox.copy(this.field.isocentre).addScaledVector(this.axes.beam, -SOURCE_ISOCENTRE_MM).applyMatrix4(this.boxFromCt);
    this.image.turn();
  }

  /** Brings picture, catheter and text up to date; returns whether anything has changed. Allocates nothing when nothing has. */
  update(nowMs: number, track: DrawnTrack | null, shown: boolean, moved: boolean, message: string): boolean {
    const made = this.image.update(nowMs);
    const ghost = shown && track !== null && (track.status === "coasting" || track.stale);
    this.tube.visible = this.beyond.visible = shown;
    if (shown && track !== null) this.goOn(track);
    this.tube.material.uniforms["ghost"]!.value = this.beyond.material.uniforms["ghost"]!.value = ghost ? 1 : 0;
    const uniforms = this.picture.uniforms;
    uniforms["depth"]!.value = this.image.texture;
    if (moved || made) uniforms["seed"]!.value = Math.floor((nowMs / 1000) * PULSES_HZ) % 4096;
    return this.write(message, ghost) || made || moved;
  }

  /** A preset's button turns the arm there; dragging turns it by hand: to the right shows more of what was on the left. */
  pointer(u: number, v: number, phase: PointerPhase): boolean {
    const { from } = this;
    const preset = this.buttons && phase === "press" ? presetAt(u, v, this.textScale) : null;
    if (preset !== null) {
      from.held = false;
      this.onTurn(preset.angles);
    } else if (phase === "press") {
      Object.assign(from, { u, v, angles: this.angles, held: true });
    } else if (phase === "drag" && from.held) {
      const turned = (start: number, share: number, most: number): number =>
        Math.min(most, Math.max(-most, Math.round(start + share * DEGREES_PER_PLATE)));
      this.onTurn({
        laoDeg: turned(from.angles.laoDeg, from.u - u, 100), cranialDeg: turned(from.angles.cranialDeg, from.v - v, 45),
      });
    } else if (phase === "release") {
      from.held = false;
    }
    return true;
  }

  dispose(): void {
    this.image.dispose();
    this.overlay.dispose();
    this.group.removeFromParent();
    for (const part of this.parts) {
      if (part !== this.tube) part.geometry.dispose(); // the tube's surface belongs to the catheter
      (part.material as RawShaderMaterial | MeshBasicMaterial).dispose();
    }
  }

  private write(message: string, ghost: boolean): boolean {
    const { told, textScale, buttons } = this;
    if (message === told.message && ghost === told.ghost && sameArm(this.angles, told.angles) && textScale === told.textScale
      && buttons === told.buttons) return false;
    Object.assign(told, { name: this.title, angles: this.angles, message, ghost, textScale, buttons });
    this.overlay.draw(told, this.axes);
    return true;
  }

  /** Lays the straight part beyond the entry on from the catheter's end. */
  private goOn(track: DrawnTrack): void {
    const { points, count } = track;
    const last = 3 * (count - 1);
    const inner = 3 * Math.max(0, count - 4);
    this.entry.set(points[last]!, points[last + 1]!, points[last + 2]!);
    this.back.set(points[inner]!, points[inner + 1]!, points[inner + 2]!).sub(this.entry).negate();
    if (this.back.lengthSq() < 1e-9) this.back.set(-1, 0, 0);
    this.back.normalize();
    this.turn.setFromUnitVectors(UP, this.back);
    this.entry.addScaledVector(this.back, BEYOND_MM / 2);
    (this.beyond.material.uniforms["boxFromPart"]!.value as Matrix4).compose(this.entry, this.turn, this.size);
  }

  private catheterMaterial(plain: 0 | 1): RawShaderMaterial {
    return new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: CATHETER_VERTEX, fragmentShader: CATHETER,
      uniforms: {
        pictureFromBox: { value: this.pictureFromBox }, boxFromPart: { value: new Matrix4() }, sourceBox: { value: this.sourceBox },
        halfSide: { value: SIDE_M / 2 }, contrast: { value: CONTRAST }, ghost: { value: 0 }, plain: { value: plain },
        arrayMm: { value: ARRAY_BEHIND_TIP_MM },
      },
      side: DoubleSide, transparent: true, forceSinglePass: true, depthWrite: false,
      blending: CustomBlending, blendEquation: AddEquation, blendSrc: ZeroFactor, blendDst: SrcColorFactor,
    });
  }
}

const UP = new Vector3(0, 1, 0);
