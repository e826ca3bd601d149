/** The places to reach and the landmarks, drawn; and the watch over the one in force. */

import {
  BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, InstancedMesh, Line, LineDashedMaterial, Matrix4, Mesh, MeshLambertMaterial,
  Quaternion, Raycaster, SphereGeometry, Vector2, Vector3,
} from "three";
import type { Sprite } from "three";
import type { SceneDescription } from "../generated/messages";
import { ARRAY_BEHIND_TIP_MM } from "../ice/transducer";
import type { TargetMeasure } from "../maths/target";
import { Dwell, measureTarget } from "../maths/target";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import { makeLabel } from "./label";
import type { Target } from "./target_book";
import type { TargetReadout } from "./target_readout";
import { ReachedTone } from "./tone";

const COLOUR = 0xffd166;
const NEAR_COLOUR = 0x7dd3fc;
const REACHED_COLOUR = 0x4ade80;
const LANDMARK_COLOUR = "#ffd166";
/** Those that are not in force are small: where they are, not how large. */
const OTHER_MM = 1.6;
const BALL_ORDER = 30;
const LABEL_ABOVE_MM = 4;

/** Told when a target is reached. secondsS: since it was put in force. */
export type OnReached = (target: Target, secondsS: number) => void;

export class Targets implements Feature {
  onReached: OnReached = () => undefined;
  readonly dwell = new Dwell();
  private readonly group = new Group();
  private readonly ball: Mesh<SphereGeometry, MeshLambertMaterial>;
  private readonly way: Line<BufferGeometry, LineDashedMaterial>;
  private readonly wayEnds = new BufferAttribute(new Float32Array(6), 3).setUsage(DynamicDrawUsage);
  private readonly wayLengths = new BufferAttribute(new Float32Array(2), 1).setUsage(DynamicDrawUsage);
  private others: InstancedMesh<SphereGeometry, MeshLambertMaterial> | null = null;
  private labels: Sprite[] = [];
  private readonly tone = new ReachedTone();
  private readonly measure: TargetMeasure = { distanceMm: 0, angleDeg: 0, beamAngleDeg: 0 };
  /** Middle of the array's face in the tip's frame, mm. */
  private readonly array: [number, number, number] = [1.5, 0, -ARRAY_BEHIND_TIP_MM];
  private readonly figures: { -readonly [K in keyof TargetReadout]: TargetReadout[K] } = {
    name: "", distanceMm: 0, angleDeg: 0, beamAngleDeg: null, within: false, dwelt: 0, reached: false,
  };
  private watched = "";
  private watchedS = 0;
  private dirty = true;
  private builtFrom = "";
  private shownShare = -1;

  constructor(private readonly stage: Stage) {
    const material = new MeshLambertMaterial({ color: COLOUR, transparent: true, opacity: 0.4, depthWrite: false });
    this.ball = new Mesh(new SphereGeometry(1, 32, 20), material);
    this.ball.renderOrder = BALL_ORDER;
    const geometry = new BufferGeometry().setAttribute("position", this.wayEnds).setAttribute("lineDistance", this.wayLengths);
    this.way = new Line(geometry, new LineDashedMaterial({ color: COLOUR, dashSize: 2, gapSize: 1.5, transparent: true, opacity: 0.8 }));
    this.way.frustumCulled = false;
    this.way.renderOrder = BALL_ORDER;
    this.group.name = "targets";
    this.group.add(this.ball, this.way);
    stage.view.box.add(this.group);
    const refresh = (): void => void (this.dirty = true);
    stage.store.listen(refresh);
    stage.targets.listen(refresh);
    stage.view.renderer.domElement.addEventListener("dblclick", (event) => this.placeAt(event));
    for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, () => this.wake(), { passive: true });
  }

  describe(scene: SceneDescription): void {
    this.array[0] = scene.catheter_diameter_mm / 2;
    this.restart();
  }

  update(frame: Frame): boolean {
    const changed = this.dirty && this.rebuild();
    this.dirty = false;
    const { store, targets, tip } = this.stage;
    const target = store.value.targets ? targets.active : null;
    const known = target !== null && tip.valid && frame.track?.stale === false;
    this.ball.visible = target !== null;
    this.way.visible = known;
    if (!known) {
      this.dwell.interrupt();
      this.stage.readout.target = null;
      return this.paint() || changed;
    }
    this.watch(target, frame.dtS);
    this.pointTo(target);
    return this.paint() || changed;
  }

  /** Begins the watch over the present target anew: it counts as not reached. */
  restart(): void {
    this.dwell.clear();
    this.watchedS = 0;
    this.dirty = true;
  }

  private wake(): void {
    if (this.stage.store.value.sound && this.stage.store.value.targets) this.tone.wake();
  }

  /** Places a target where a double click meets the heart. */
  private placeAt({ offsetX, offsetY }: MouseEvent): void {
    const { store, view, heart, targets } = this.stage;
    if (!store.value.targets || store.locked("targets") || view.immersive) return;
    const { clientWidth, clientHeight } = view.renderer.domElement;
    const ray = new Raycaster();
    ray.setFromCamera(new Vector2((2 * offsetX) / clientWidth - 1, 1 - (2 * offsetY) / clientHeight), view.camera);
    const met = ray.intersectObject(heart.group, true).find(({ object }) => object.visible);
    if (met !== undefined) targets.add(view.box.worldToLocal(met.point.clone()));
  }

  private watch(target: Target, dtS: number): void {
    const { tip, store } = this.stage;
    if (target.id !== this.watched) {
      this.watched = target.id;
      this.dwell.clear();
      this.watchedS = 0;
    }
    this.watchedS += dtS;
    const { measure, figures, dwell } = this;
    const { x, y, z } = target.position;
    measureTarget(measure, tip.matrix.elements, x, y, z, this.array);
    const reached = dwell.step(measure.distanceMm, measure.angleDeg, dtS);
    figures.name = target.name;
    figures.distanceMm = measure.distanceMm;
    figures.angleDeg = measure.angleDeg;
    figures.beamAngleDeg = tip.beam ? measure.beamAngleDeg : null;
    figures.within = dwell.within;
    figures.dwelt = dwell.share;
    figures.reached = dwell.reached;
    this.stage.readout.target = figures;
    if (!reached) return;
    if (store.value.sound) this.tone.play();
    this.onReached(target, this.watchedS);
  }

  /** Draws the way from the tip to the target. */
  private pointTo(target: Target): void {
    const from = this.stage.tip.matrix.elements;
    const { x, y, z } = target.position;
    this.wayEnds.setXYZ(0, from[12]!, from[13]!, from[14]!).setXYZ(1, x, y, z);
    this.wayLengths.setX(1, this.measure.distanceMm);
    this.wayEnds.needsUpdate = this.wayLengths.needsUpdate = true;
  }

  /** Colours the target by how far it is from being reached; returns whether that has changed. */
  private paint(): boolean {
    const { dwell, ball } = this;
    const share = dwell.reached ? 2 : dwell.within ? dwell.share : -1;
    if (share === this.shownShare) return false;
    this.shownShare = share;
    const colour = ball.material.color.setHex(dwell.reached ? REACHED_COLOUR : dwell.within ? NEAR_COLOUR : COLOUR);
    if (dwell.within && !dwell.reached) colour.lerp(GREEN, 0.7 * share);
    ball.material.opacity = dwell.reached ? 0.6 : dwell.within ? 0.5 : 0.35;
    this.way.material.color.copy(colour);
    return true;
  }

  /** Makes balls and labels anew where that is needed; returns whether it was. */
  private rebuild(): boolean {
    const { store, targets, view } = this.stage;
    const { targets: reaching, landmarks } = store.value;
    const active = reaching ? targets.active : null;
    const key = `${reaching} ${landmarks} ${targets.version}`;
    if (key === this.builtFrom) return false;
    this.builtFrom = key;
    this.clear();
    if (active !== null) {
      this.ball.position.copy(active.position);
      this.ball.scale.setScalar(active.radiusMm);
    }
    const others = targets.targets.filter((target) => target !== active && (reaching || (landmarks && !target.own)));
    this.others = makeDots(others);
    if (this.others !== null) this.group.add(this.others);
    for (const target of targets.targets) {
      if (target === active || (landmarks && !target.own)) this.addLabel(target, target === active ? "#ffffff" : LANDMARK_COLOUR);
    }
    this.shownShare = NaN;
    view.resize();
    return true;
  }

  private addLabel(target: Target, colour: string): void {
    const label = makeLabel(target.name, colour);
    label.position.copy(target.position).setZ(target.position.z + target.radiusMm + LABEL_ABOVE_MM);
    this.labels.push(label);
    this.group.add(label);
  }

  private clear(): void {
    for (const label of this.labels) {
      label.material.map?.dispose();
      label.material.dispose();
      label.removeFromParent();
    }
    this.labels = [];
    this.others?.removeFromParent();
    this.others?.dispose();
    this.others?.geometry.dispose();
    this.others?.material.dispose();
    this.others = null;
  }
}

const GREEN = new Color(REACHED_COLOUR);

/** Returns small balls at targets, all in one go; null for none. */
function makeDots(targets: readonly Target[]): InstancedMesh<SphereGeometry, MeshLambertMaterial> | null {
  if (targets.length === 0) return null;
  const material = new MeshLambertMaterial({ color: COLOUR, transparent: true, opacity: 0.75 });
  const dots = new InstancedMesh(new SphereGeometry(OTHER_MM, 16, 10), material, targets.length);
  const place = new Matrix4();
  targets.forEach(({ position }, i) => dots.setMatrixAt(i, place.compose(position, new Quaternion(), new Vector3(1, 1, 1))));
  dots.renderOrder = BALL_ORDER;
  return dots;
}
