/** The places to reach and the landmarks, drawn; and what happens when the one in force is reached. */

import { Group, InstancedMesh, Matrix4, MeshLambertMaterial, Quaternion, Raycaster, SphereGeometry, Vector2, Vector3 } from "three";
import type { SceneDescription } from "../generated/messages";
import type { ReachBy } from "../maths/target";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import type { LabelMaker } from "./declutter";
import { RANK } from "./label";
import { LabelSet } from "./label_set";
import type { Target } from "./target_book";
import { BALL_ORDER, TARGET_COLOURS, TargetMark } from "./target_mark";
import { TargetWatch } from "./target_watch";
import { ReachedTone } from "./tone";

const LANDMARK_COLOUR = "#ffd166";
/** Those that are not in force are small: where they are, not how large. */
const OTHER_MM = 1.6;

/** Told once when a target is reached. t: the instant by the Tracks' clock, s; how: by the tip or by the beam. */
export type OnReached = (id: string, t: number, how: ReachBy) => void;

export class Targets implements Feature, LabelMaker {
  onReached: OnReached = () => undefined;
  labelsVersion = 0;
  readonly watch = new TargetWatch();
  private readonly group = new Group();
  private readonly mark = new TargetMark(this.group);
  private readonly labels = new LabelSet(this.group);
  /** Kept: a material that goes takes its program along, and the next one would be compiled in the middle of a session. */
  private readonly dot = {
    shape: new SphereGeometry(OTHER_MM, 16, 10),
    material: new MeshLambertMaterial({ color: TARGET_COLOURS.open, transparent: true, opacity: 0.75 }),
  };
  private others: InstancedMesh<SphereGeometry, MeshLambertMaterial> | null = null;
  private readonly tone = new ReachedTone();
  private dirty = true;
  private builtFrom = "";
  private shownShare = -1;

  constructor(private readonly stage: Stage) {
    this.group.name = "targets";
    stage.view.box.add(this.group);
    const refresh = (): void => void (this.dirty = true);
    stage.store.listen(refresh);
    stage.targets.listen(refresh);
    stage.training.listen(refresh);
    stage.view.renderer.domElement.addEventListener("dblclick", (event) => this.placeAt(event));
    for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, () => this.wake(), { passive: true });
  }

  describe(scene: SceneDescription): void {
    this.watch.describe(scene.catheter_diameter_mm);
    this.dirty = true;
    this.labelsVersion += 1; // the box's own labels are new too
  }

  update(frame: Frame): boolean {
    const changed = this.dirty && this.rebuild();
    this.dirty = false;
    const { store, targets, tip, readout } = this.stage;
    const target = this.shown ? targets.active : null;
    const { track } = frame;
    const known = target !== null && tip.valid && track !== null && !track.stale;
    this.mark.ball.visible = target !== null;
    this.mark.way.visible = known;
    if (!known) {
      if (target === null) this.watch.restart();
      else this.watch.interrupt();
      readout.target = null;
      return this.paint(frame) || changed;
    }
    const { watch } = this;
    const reached = watch.step(target, tip, track, store.value.ice, store.value.depthMm);
    readout.target = watch.figures;
    if (reached) {
      if (store.value.sound) this.tone.play();
      this.onReached(target.id, track.t, watch.by);
    }
    this.pointTo(target);
    return this.paint(frame) || changed;
  }

  /** Whether these targets are to be seen: not beside those of a trial, nor of a run that is shown again. */
  private get shown(): boolean {
    const { store, training, replay } = this.stage;
    return store.value.targets && !training.atHand && !replay.shown;
  }

  /** Begins the watch over the present target anew: it counts as not reached. */
  restart(): void {
    this.watch.restart();
    this.dirty = true;
  }

  private wake(): void {
    if (this.stage.store.value.sound && this.stage.store.value.targets) this.tone.wake();
  }

  /** Places a target where a double click meets the heart. */
  private placeAt({ offsetX, offsetY }: MouseEvent): void {
    const { store, view, heart, targets } = this.stage;
    if (!this.shown || store.locked("targets") || view.immersive) return;
    const { clientWidth, clientHeight } = view.renderer.domElement;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2((2 * offsetX) / clientWidth - 1, 1 - (2 * offsetY) / clientHeight), view.camera);
    const met = ray.intersectObject(heart.group, true).find(({ object }) => object.visible);
    if (met !== undefined) targets.add(view.box.worldToLocal(met.point.clone()));
  }

  /** Draws the way that counts: from the tip, or across from the beam's middle line. */
  private pointTo({ position }: Target): void {
    const { figures } = this.watch;
    const m = this.stage.tip.matrix.elements;
    const byBeam = figures.by === "beam" && figures.beamDistanceMm !== null;
    const from = byBeam ? this.watch.foot : null;
    this.mark.wayFrom(from?.[0] ?? m[12]!, from?.[1] ?? m[13]!, from?.[2] ?? m[14]!);
    this.mark.wayTo(position.x, position.y, position.z, byBeam ? figures.beamDistanceMm! : figures.distanceMm);
  }

  /** Colours the target by how far it is from being reached, and fills its ring; returns whether that has changed. */
  private paint(frame: Frame): boolean {
    const { watch: { dwell }, mark: { ball, ring, way } } = this;
    ring.visible = ball.visible && dwell.within && !dwell.reached;
    if (ring.visible) this.mark.fillRing(dwell.share, frame, this.stage.view);
    const share = dwell.reached ? 2 : dwell.within ? dwell.share : -1;
    if (share === this.shownShare) return false;
    this.shownShare = share;
    const { open, near, reached } = TARGET_COLOURS;
    const colour = ball.material.color.copy(dwell.reached ? reached : dwell.within ? near : open);
    if (dwell.within && !dwell.reached) colour.lerp(reached, 0.7 * share);
    ball.material.opacity = dwell.reached ? 0.6 : dwell.within ? 0.5 : 0.35;
    way.material.color.copy(colour);
    return true;
  }

  /** Makes balls and labels anew where that is needed; returns whether it was. */
  private rebuild(): boolean {
    const { store, targets, view } = this.stage;
    const { landmarks } = store.value;
    const reaching = this.shown;
    const active = reaching ? targets.active : null;
    const key = `${reaching} ${landmarks} ${targets.version}`;
    if (key === this.builtFrom) return false;
    this.builtFrom = key;
    this.clear();
    if (active !== null) this.mark.place(active.position, active.radiusMm);
    const others = targets.targets.filter((target) => target !== active && (reaching || (landmarks && !target.own)));
    this.others = this.makeDots(others);
    if (this.others !== null) this.group.add(this.others);
    for (const target of targets.targets) {
      if (target === active || (landmarks && !target.own)) this.addLabel(target, target === active);
    }
    this.shownShare = NaN;
    this.labelsVersion += 1;
    view.resize();
    return true;
  }

  private addLabel({ name, position, radiusMm }: Target, active: boolean): void {
    this.labels.add(name, active ? "#ffffff" : LANDMARK_COLOUR, active ? RANK.active : RANK.place, position, radiusMm);
  }

  private clear(): void {
    this.labels.clear();
    this.others?.removeFromParent();
    this.others?.dispose();
    this.others = null;
  }

  /** Returns small balls at targets, all in one go; null for none. */
  private makeDots(targets: readonly Target[]): InstancedMesh<SphereGeometry, MeshLambertMaterial> | null {
    if (targets.length === 0) return null;
    const dots = new InstancedMesh(this.dot.shape, this.dot.material, targets.length);
    const place = new Matrix4();
    targets.forEach(({ position }, i) => dots.setMatrixAt(i, place.compose(position, new Quaternion(), new Vector3(1, 1, 1))));
    dots.renderOrder = BALL_ORDER;
    return dots;
  }
}
