/** Where the viewer stands: fixed views of the box, and one that rides behind the tip. */

import type { Object3D, PerspectiveCamera } from "three";
import { Spherical, Vector3 } from "three";
import type { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { SceneDescription } from "../generated/messages";
import type { Centreline } from "../maths/centreline";
import type { View } from "./view";

export type Preset = "iso" | "top" | "front" | "along";
export const PRESETS: readonly Preset[] = ["iso", "top", "front", "along"];

/** Azimuth about the vertical and angle from it, rad: seen from the front camera's side (box -y), x to the right. */
const ANGLES: Record<Exclude<Preset, "along">, readonly [number, number]> = {
  iso: [-0.6, 1.13],
  top: [0, 0.0001],
  front: [0, Math.PI / 2],
};
const TRAVEL_MS = 350;
/** Size of the picture over the size of what must be in it. */
const ROOM = 1.13;
const BEHIND_MM = 42;
const EASE_MS = 150;
const ABOVE_MM = 14;
const AHEAD_MM = 25;

export class Presets {
  /** The preset in force; null once the viewer has turned the view by hand. */
  current: Preset | null = null;
  onChange: (preset: Preset | null) => void = () => undefined;
  private readonly centre = new Vector3();
  /** Half the region's size along the scene's x, z and y, m. */
  private readonly half = new Vector3(0.06, 0.06, 0.06);
  private readonly from = { offset: new Spherical(), target: new Vector3() };
  private readonly to = { offset: new Spherical(), target: new Vector3() };
  private readonly work = new Vector3();
  private readonly spherical = new Spherical();
  private startedMs = -Infinity;
  private travelling = false;
  private lastMs = 0;
  private readonly still: boolean;
  private readonly camera: PerspectiveCamera;
  private readonly controls: OrbitControls;
  private readonly box: Object3D;

  constructor(private readonly view: View) {
    this.camera = view.camera;
    this.controls = view.controls;
    this.box = view.box;
    this.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls.addEventListener("start", () => this.set(null));
  }

  /** Frames the region of interest of a new scene. */
  describe(scene: SceneDescription): void {
    const low = new Vector3(...scene.roi_min_mm);
    const high = new Vector3(...scene.roi_max_mm);
    this.box.updateMatrixWorld(true);
    this.centre.addVectors(low, high).multiplyScalar(0.5).applyMatrix4(this.box.matrixWorld);
    this.half.subVectors(high, low).multiplyScalar(0.5 / 1000);
  }

  /** Goes to a view; at once where the viewer asks for little motion. */
  go(preset: Preset, nowMs: number): void {
    this.set(preset);
    if (preset === "along") return;
    const [azimuth, polar] = ANGLES[preset];
    this.from.offset.setFromVector3(this.work.subVectors(this.camera.position, this.controls.target));
    this.from.target.copy(this.controls.target);
    this.to.offset.set(this.distance(azimuth, polar), polar, azimuth);
    this.to.target.copy(this.centre);
    this.startedMs = this.still ? -Infinity : nowMs;
    this.place(this.still ? 1 : 0);
    this.travelling = !this.still;
  }

  /** Moves the camera on; `line` is the drawn catheter, null when none is. Called once for each frame. */
  update(nowMs: number, line: Centreline | null): void {
    if (this.current === "along") {
      if (line !== null) this.ride(line, Math.max(0, nowMs - this.lastMs));
    } else if (this.travelling) {
      const share = Math.min(1, (nowMs - this.startedMs) / TRAVEL_MS);
      this.place(share * share * (3 - 2 * share));
      this.travelling = share < 1;
    }
    this.lastMs = nowMs;
  }

  private set(preset: Preset | null): void {
    if (preset === null) this.travelling = false;
    if (preset === this.current) return;
    this.current = preset;
    this.onChange(preset);
  }

  /** Returns how far to stand so that every corner of the region is in the picture, with some room around it. */
  private distance(azimuth: number, polar: number): number {
    const half = Math.tan((this.camera.fov * Math.PI) / 360) / ROOM;
    const up = half * this.view.clearShare;
    const across = half * this.camera.aspect;
    const [sa, ca, sp, cp] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(polar), Math.cos(polar)];
    let result = 0;
    for (let corner = 0; corner < 8; corner++) {
      const x = (corner & 1 ? 1 : -1) * this.half.x;
      const y = (corner & 2 ? 1 : -1) * this.half.z;
      const z = (corner & 4 ? 1 : -1) * this.half.y;
      const right = x * ca - z * sa;
      const towards = (x * sa + z * ca) * sp + y * cp;
      const above = y * sp - (x * sa + z * ca) * cp;
      result = Math.max(result, towards + Math.abs(right) / across, towards + Math.abs(above) / up);
    }
    return result;
  }

  private place(share: number): void {
    const { from, to } = this;
    let turn = to.offset.theta - from.offset.theta;
    turn -= 2 * Math.PI * Math.round(turn / (2 * Math.PI)); // the short way round
    this.spherical.set(
      from.offset.radius + share * (to.offset.radius - from.offset.radius),
      from.offset.phi + share * (to.offset.phi - from.offset.phi),
      from.offset.theta + share * turn,
    ).makeSafe();
    this.controls.target.lerpVectors(from.target, to.target, share);
    this.camera.position.setFromSpherical(this.spherical).add(this.controls.target);
    this.controls.update();
  }

  /** Stands behind and above the tip and looks past it, eased so that noise does not shake the view. */
  private ride(line: Centreline, passedMs: number): void {
    const p = line.position;
    const f = line.forward;
    const ease = this.still ? 1 : 1 - Math.exp(-passedMs / EASE_MS);
    this.work.set(p[0]! + AHEAD_MM * f[0]!, p[1]! + AHEAD_MM * f[1]!, p[2]! + AHEAD_MM * f[2]!);
    this.controls.target.lerp(this.work.applyMatrix4(this.box.matrixWorld), ease);
    this.work.set(p[0]! - BEHIND_MM * f[0]!, p[1]! - BEHIND_MM * f[1]!, p[2]! - BEHIND_MM * f[2]! + ABOVE_MM);
    this.camera.position.lerp(this.work.applyMatrix4(this.box.matrixWorld), ease);
    this.controls.update();
  }
}
