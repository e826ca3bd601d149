/** Where the world stands while a session runs: put somewhere, held by hands, and on its way in between. */

import type { Group, Object3D, PerspectiveCamera } from "three";
import { BackSide, Box3, Mesh, MeshBasicMaterial, Quaternion, SphereGeometry, Vector3 } from "three";
import type { Stage } from "../stage/stage";
import { Grab } from "./grab";
import type { Head, Placement } from "./placement";
import { inside, onTable, trueScale } from "./placement";
import { Similarity } from "./similarity";
import { standpoint } from "./standpoint";

const TRAVEL_MS = 420;
/** To be inside all at once is dizzying: the view is dark for a moment instead. */
const DARK_MS = 380;
/** Where nothing is known of the blood, the head goes this far behind the tip. */
const UNKNOWN_BACK_MM = 25;
/** From where a tip is seen best, in its own frame: behind it, but neither in its shaft nor in its beam. */
const ASIDE = new Vector3(-0.66, 0, -0.75);
const box = new Box3();

export class Places {
  readonly grab = new Grab();
  /** The place chosen last; null once hands have changed it. */
  current: Placement | null = null;
  private readonly world: Group;
  private readonly box: Object3D;
  private readonly to = new Similarity();
  private readonly from = new Similarity();
  private readonly step = new Similarity();
  /** The heart's middle, in the world's own frame, m. */
  readonly centre = new Vector3();
  private readonly centreFrom = new Vector3();
  private readonly centreTo = new Vector3();
  private startedMs = -1;
  private darkSinceMs = -1;
  private readonly dark: Mesh<SphereGeometry, MeshBasicMaterial>;

  constructor(
    private readonly stage: Pick<Stage, "world" | "tip" | "blood" | "targets" | "view">, camera: PerspectiveCamera,
  ) {
    this.world = stage.world;
    this.box = stage.view.box;
    this.dark = new Mesh(
      new SphereGeometry(0.2, 16, 12),
      new MeshBasicMaterial({ color: 0x05080c, side: BackSide, transparent: true, depthTest: false, depthWrite: false }),
    );
    this.dark.renderOrder = 1000;
    this.dark.visible = false;
    camera.add(this.dark);
  }

  /** How many times as large as life the world is. */
  get scale(): number {
    return this.grab.world.scale;
  }

  get travelling(): boolean {
    return this.startedMs >= 0;
  }

  /** Goes to a place; `atOnce`: without a way there, as at a session's beginning. */
  go(placement: Placement, head: Head, nowMs: number, atOnce = false): void {
    this.findCentre();
    const { to, centre } = this;
    if (placement === "table") onTable(to, head, centre);
    else if (placement === "true") trueScale(to, this.grab.world, head, centre);
    else this.goInside(head);
    this.current = placement;
    if (atOnce || placement === "inside" || this.scale > 4) {
      this.startedMs = -1;
      if (!atOnce) this.darkSinceMs = nowMs;
      this.put(to);
      return;
    }
    this.from.copy(this.grab.world);
    this.from.apply(this.centreFrom.copy(centre));
    to.apply(this.centreTo.copy(centre));
    this.startedMs = nowMs;
  }

  /** Moves the world on. Returns whether it moved. Called once a frame while a session runs. */
  update(nowMs: number): boolean {
    this.lighten(nowMs);
    if (this.grab.hands > 0) {
      this.startedMs = -1;
      this.current = null;
    }
    if (this.startedMs >= 0) {
      const share = Math.min(1, (nowMs - this.startedMs) / TRAVEL_MS);
      const eased = share * share * (3 - 2 * share);
      this.step.between(this.from, this.to, eased);
      this.step.pin(this.centre, this.centreFromTo(eased));
      this.put(this.step);
      if (share >= 1) this.startedMs = -1;
      return true;
    }
    if (!this.grab.update(nowMs)) return false;
    this.grab.world.writeTo(this.world);
    return true;
  }

  /** Puts the world back to where a page has it. */
  restore(): void {
    this.grab.releaseAll();
    this.startedMs = this.darkSinceMs = -1;
    this.dark.visible = false;
    this.put(this.step.identity());
  }

  private put(world: Similarity): void {
    this.grab.place(world);
    world.writeTo(this.world);
  }

  private readonly between = new Vector3();
  private centreFromTo(share: number): Vector3 {
    return this.between.lerpVectors(this.centreFrom, this.centreTo, share);
  }

  /** Into the chamber where the tip is; where that is in none, where the target in force is; else the heart's middle. */
  private goInside(head: Head): void {
    const { tip, blood, targets } = this.stage;
    const eye = new Vector3();
    const anchor = new Vector3();
    const behind = new Vector3(-1, 0, 0);
    this.box.updateMatrix();
    if (tip.valid) behind.copy(ASIDE).transformDirection(tip.matrix);
    const middle = this.centre.clone().applyMatrix4(this.box.matrix.clone().invert());
    const anchors: Vector3[] = [middle];
    if (targets.active !== null) anchors.unshift(targets.active.position);
    if (tip.valid) {
      const at = new Vector3().setFromMatrixPosition(tip.matrix);
      if (blood === null || blood.chamberAt(at) !== 0) anchors.unshift(at);
      else anchors.splice(1, 0, at);
    }
    let found = false;
    for (const each of anchors) {
      anchor.copy(each);
      if (blood !== null && standpoint(eye, blood, anchor, behind)) {
        found = true;
        break;
      }
    }
    if (!found) eye.copy(anchor.copy(anchors[0]!)).addScaledVector(behind, UNKNOWN_BACK_MM);
    const direction = anchor.sub(eye);
    if (direction.lengthSq() < 1) direction.copy(behind).negate();
    inside(this.to, head, eye.applyMatrix4(this.box.matrix), direction.transformDirection(this.box.matrix));
  }

  /** The heart's middle, or the box's where there is no heart; measured with the world at rest. */
  private findCentre(): void {
    const { world } = this;
    const heart = this.box.getObjectByName("heart");
    const thing = heart !== undefined && heart.children.length > 0 ? heart : this.box.getObjectByName("roi");
    if (thing === undefined) return;
    const position = world.position.clone();
    const turn: Quaternion = world.quaternion.clone();
    const size = world.scale.x;
    this.step.identity().writeTo(world);
    world.updateMatrixWorld(true);
    box.setFromObject(thing);
    if (!box.isEmpty()) box.getCenter(this.centre);
    this.step.set(position, turn, size).writeTo(world);
    world.updateMatrixWorld(true);
  }

  private lighten(nowMs: number): void {
    if (this.darkSinceMs < 0) return;
    const share = Math.min(1, (nowMs - this.darkSinceMs) / DARK_MS);
    this.dark.visible = share < 1;
    this.dark.material.opacity = 1 - share * share;
    if (share >= 1) this.darkSinceMs = -1;
  }
}
