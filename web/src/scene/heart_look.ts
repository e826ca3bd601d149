/** How the heart looks now: its parts' opacities, their order, and the plane that cuts it open. */

import { Plane, Vector3 } from "three";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import type { HeartPart } from "./heart_part";

/** Orders of drawing: all far faces first, then all near ones, each from the farthest part to the nearest. */
const FAR_ORDER = 10;
const NEAR_ORDER = 20;
/** Between two parts, in these units. */
const ORDER_STEP = 0.1;
/** Two parts change places only when one is further by more than this: no flicker at a draw. */
const HYSTERESIS_MM = 3;
const MOST_PARTS = 32;

export class HeartLook implements Feature {
  private version = -1;
  private dirty = true;
  private readonly far = new Int32Array(MOST_PARTS);
  private readonly near = new Int32Array(MOST_PARTS);
  private readonly keys = new Float64Array(MOST_PARTS);
  private readonly planes = [new Plane()];
  private readonly none: Plane[] = [];
  private cutting = false;
  private readonly eye = new Vector3();
  private readonly point = new Vector3();
  private readonly normal = new Vector3();
  private readonly shown = { normal: new Vector3(), constant: NaN };

  constructor(private readonly stage: Stage) {
    stage.view.renderer.localClippingEnabled = true;
    stage.store.listen(() => (this.dirty = true));
  }

  update(frame: Frame): boolean {
    const { heart, view } = this.stage;
    if (this.version !== heart.version) {
      this.version = heart.version;
      this.dirty = true;
      for (let i = 0; i < MOST_PARTS; i++) this.far[i] = this.near[i] = i;
    }
    const changed = this.dirty;
    if (this.dirty) this.dress();
    this.dirty = false;
    if (frame.immersive) this.eye.copy(view.head.position);
    else this.eye.setFromMatrixPosition(view.camera.matrixWorld);
    view.box.worldToLocal(this.eye);
    this.arrange();
    return this.cut(frame) || changed;
  }

  /** Gives every part what the settings say. */
  private dress(): void {
    const { heart, store } = this.stage;
    const weights = relativeDensities(heart.parts);
    heart.parts.forEach((part, i) => {
      const { visible, opacity } = store.part(part.description.name);
      part.show(visible, 1 - (1 - opacity) ** weights[i]!);
    });
  }

  /**
   * Sorts far faces by how far a part reaches, near ones by where it begins: a part that lies within another one is drawn
   * between the other's far and near faces, as it should be. Insertion into the last order: nearly always nothing moves.
   */
  private arrange(): void {
    const { parts } = this.stage.heart;
    const count = Math.min(parts.length, MOST_PARTS);
    this.sort(this.far, count, 1);
    this.sort(this.near, count, -1);
    for (let rank = 0; rank < count; rank++) this.keys[this.far[rank]!] = FAR_ORDER + rank * ORDER_STEP;
    for (let rank = 0; rank < count; rank++) {
      const part = this.near[rank]!;
      parts[part]!.order(this.keys[part]!, NEAR_ORDER + rank * ORDER_STEP);
    }
  }

  private sort(order: Int32Array, count: number, sign: number): void {
    const { parts } = this.stage.heart;
    for (let i = 0; i < count; i++) this.keys[i] = this.reach(parts[i]!, sign);
    for (let i = 1; i < count; i++) {
      const moving = order[i]!;
      let at = i;
      while (at > 0 && this.keys[order[at - 1]!]! < this.keys[moving]! - HYSTERESIS_MM) {
        order[at] = order[at - 1]!;
        at -= 1;
      }
      order[at] = moving;
    }
  }

  /** Returns how far from the eye a part ends (sign 1) or begins (-1), mm. */
  private reach(part: HeartPart, sign: number): number {
    const x = part.centre.x - this.eye.x, y = part.centre.y - this.eye.y, z = part.centre.z - this.eye.z;
    const distance = Math.sqrt(x * x + y * y + z * z) || 1;
    const extent = (Math.abs(x) * part.half.x + Math.abs(y) * part.half.y + Math.abs(z) * part.half.z) / distance;
    return distance + sign * extent;
  }

  /** Cuts by the plane that the settings name, if there is one now; returns whether it has moved. */
  private cut(frame: Frame): boolean {
    const cutting = this.place(frame);
    const { heart, view } = this.stage;
    for (const part of heart.parts) part.cut(cutting ? this.planes : this.none);
    if (cutting) {
      const plane = this.planes[0]!;
      plane.setFromNormalAndCoplanarPoint(this.normal.negate(), this.point).applyMatrix4(view.box.matrixWorld);
      const moved = Math.abs(plane.constant - this.shown.constant) > 1e-5 || plane.normal.distanceToSquared(this.shown.normal) > 1e-8;
      if (moved || !this.cutting) {
        this.shown.constant = plane.constant;
        this.shown.normal.copy(plane.normal);
        this.cutting = true;
        return true;
      }
      return false;
    }
    const was = this.cutting;
    this.cutting = false;
    this.shown.constant = NaN;
    return was;
  }

  /** Writes the plane in `box`; returns whether there is one. Without a hand it faces the viewer, through the tip. */
  private place(frame: Frame): boolean {
    const { cuts, store, tip } = this.stage;
    const by = store.value.cut;
    if (by === "off") return false;
    const plane = cuts.get(by);
    if (plane.valid) {
      this.point.copy(plane.point);
      this.normal.copy(plane.normal);
      return true;
    }
    if (by === "beam" || frame.immersive || !tip.valid) return false;
    this.point.setFromMatrixPosition(tip.matrix);
    this.normal.subVectors(this.eye, this.point).normalize();
    return this.normal.lengthSq() > 0.5;
  }
}

/** Returns how dense each part is to be compared with the others: where the heart's file says so, as it says. */
export function relativeDensities(parts: readonly { readonly description: { readonly opacity?: number | null } }[]): number[] {
  const given = parts.map(({ description }) => description.opacity ?? null);
  const known = given.filter((each): each is number => each !== null && each > 0);
  const mean = known.reduce((sum, each) => sum + each, 0) / Math.max(1, known.length);
  return given.map((each) => (each === null || each <= 0 || mean === 0 ? 1 : each / mean));
}
