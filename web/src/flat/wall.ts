/** Where plates stand in a headset: one picture beside the heart, or the cath lab's three on one large plate ahead. */

import { Group, Mesh, MeshBasicMaterial, PlaneGeometry, Vector3 } from "three";
import type { Object3D, Quaternion, Scene } from "three";
import type { Plate, PointerPhase } from "./plate";

/** Of the large plate: distance from the eyes, and the height of the pictures on it, m. */
const AHEAD_M = 1.2;
const HIGH_M = 0.5;
const GAP_M = 0.03;
/** Of the single plate, from the eyes. */
const BESIDE = { ahead: 0.78, left: 0.44, below: 0.08, widthM: 0.42 } as const;
const TEXT_SCALE = 1.8;

/** Of the headset's wearer, in the room, m. */
export interface Head {
  readonly position: Vector3;
  readonly orientation: Quaternion;
}

export class Wall implements Plate {
  readonly group = new Group();
  readonly title = "2D view";
  widthM = 1;
  readonly heightM = HIGH_M + 2 * GAP_M;
  readonly textScale = TEXT_SCALE;
  private readonly back = new Mesh(new PlaneGeometry(1, 1), new MeshBasicMaterial({ color: 0x0b1017 }));
  private readonly forward = new Vector3();
  private readonly eye = new Vector3();
  private readonly at = new Vector3();
  private plates: readonly Plate[] = [];
  private touched: Plate | null = null;

  constructor() {
    this.group.name = "flat wall";
    this.back.position.z = -0.004;
    this.back.renderOrder = 55;
    this.group.add(this.back);
  }

  /** Hangs the three pictures side by side on the large plate, ahead of the viewer. */
  hang(plates: readonly Plate[], scene: Scene, head: Head): void {
    this.clear();
    this.plates = plates;
    const widths = plates.map((plate) => (HIGH_M * plate.widthM) / plate.heightM);
    const total = widths.reduce((sum, width) => sum + width, 0) + GAP_M * (plates.length + 1);
    let left = -total / 2 + GAP_M;
    for (const [index, plate] of plates.entries()) {
      const width = widths[index]!;
      plate.group.position.set(left + width / 2, 0, 0);
      plate.group.quaternion.identity();
      plate.group.scale.setScalar(width / plate.widthM);
      plate.group.visible = true;
      this.group.add(plate.group);
      left += width + GAP_M;
    }
    this.widthM = total;
    this.back.scale.set(total, this.heightM, 1);
    this.look(head);
    this.stand(this.group, AHEAD_M, 0, 0);
    scene.add(this.group);
  }

  /** Stands one picture beside the heart, facing the viewer. */
  beside(plate: Plate, scene: Scene, head: Head): void {
    this.clear();
    this.look(head);
    plate.group.scale.setScalar(BESIDE.widthM / plate.widthM);
    plate.group.visible = true;
    this.stand(plate.group, BESIDE.ahead, BESIDE.left, BESIDE.below);
    scene.add(plate.group);
  }

  /** Gives a pointer on to the picture that it is on; while it drags, to the one that it began on. */
  pointer(u: number, v: number, phase: PointerPhase): boolean {
    if (phase === "press" || phase === "move") this.touched = this.plates.find((plate) => Math.abs(this.across(plate, u)) <= 0.5) ?? null;
    const plate = this.touched;
    if (plate?.pointer === undefined) return false;
    const up = ((v - 0.5) * this.heightM) / HIGH_M;
    return plate.pointer(0.5 + this.across(plate, u), 0.5 + up, phase);
  }

  /** Returns where a place along the wall is on a plate: -0.5 to 0.5 within it. */
  private across({ group, widthM }: Plate, u: number): number {
    return ((u - 0.5) * this.widthM - group.position.x) / (widthM * group.scale.x);
  }

  clear(): void {
    for (const plate of this.plates) if (plate.group.parent === this.group) plate.group.removeFromParent();
    this.plates = [];
    this.group.removeFromParent();
  }

  /** Takes where the viewer is and looks, level. */
  private look({ position, orientation }: Head): void {
    this.eye.copy(position);
    this.forward.set(0, 0, -1).applyQuaternion(orientation).setY(0);
    if (this.forward.lengthSq() < 1e-6) this.forward.set(0, 0, -1);
    this.forward.normalize();
  }

  private stand(what: Object3D, ahead: number, left: number, below: number): void {
    const { forward, eye, at } = this;
    at.copy(eye).addScaledVector(forward, ahead);
    at.x += left * forward.z; // left of (x, z) is (z, -x)
    at.z -= left * forward.x;
    at.y -= below;
    what.position.copy(at);
    what.lookAt(eye.x, at.y + 0.35 * (eye.y - at.y), eye.z);
  }
}
