/** The targets of a trial in the scene: the one that is offered bright, with the way to it; later ones faint, reached ones ticked. */

import { Color, Group, InstancedMesh, Matrix4, MeshLambertMaterial, Quaternion, SphereGeometry, Vector3 } from "three";
import type { SceneDescription, TrainingTarget } from "../../generated/messages";
import { ARRAY_BEHIND_TIP_MM } from "../../ice/transducer";
import { makeTargetMeasure, measureTarget } from "../../maths/target";
import type { LabelMaker } from "../../scene/declutter";
import { RANK } from "../../scene/label";
import { LabelSet } from "../../scene/label_set";
import { BALL_ORDER, TARGET_COLOURS, TargetMark } from "../../scene/target_mark";
import type { Feature, Frame } from "../../stage/feature";
import type { Stage } from "../../stage/stage";
import { shortName } from "../words";
import { PlaneFrame } from "./plane_frame";

const MISSED = new Color(0x8a6a6a);
/** Of a plane's point: what counts there is the frame. */
const POINT_MM = 2;
const OTHER_SHARE = 0.45;
/** As far as a beam is looked along, mm. */
const RANGE_MM = 120;
const LABEL_INK = { now: "#ffffff", reached: "#7ef0a8", missed: "#c9a3a3" } as const;

export class RunMarks implements Feature, LabelMaker {
  labelsVersion = 0;
  private readonly group = new Group();
  private readonly mark = new TargetMark(this.group);
  private readonly labels = new LabelSet(this.group);
  private readonly frame = new PlaneFrame();
  private readonly measure = makeTargetMeasure();
  private readonly array: [number, number, number] = [1.5, 0, -ARRAY_BEHIND_TIP_MM];
  private readonly at = new Vector3();
  private others: InstancedMesh<SphereGeometry, MeshLambertMaterial> | null = null;
  private offered: TrainingTarget | null = null;
  private builtFrom = "";
  private seenVersion = -1;
  private seenReplay = -1;
  private seenReached = -1;
  private shownShare = -1;

  constructor(private readonly stage: Stage) {
    this.group.name = "trial";
    this.group.add(this.frame.lines);
    this.group.visible = false;
    stage.view.box.add(this.group);
  }

  describe(scene: SceneDescription): void {
    this.array[0] = scene.catheter_diameter_mm / 2;
    this.labelsVersion += 1;
  }

  update(frame: Frame): boolean {
    const changed = this.refresh();
    if (!this.group.visible) return changed;
    const { offered } = this;
    const { tip } = this.stage;
    const { track } = frame;
    const known = offered !== null && tip.valid && track !== null && !track.stale && (offered.kind === "tip" || tip.beam);
    this.mark.way.visible = known;
    this.frame.lines.visible = offered !== null && offered.kind !== "tip" && offered.direction !== null;
    if (offered === null) return changed;
    if (known) this.pointTo(offered);
    if (this.frame.lines.visible) this.frame.show(offered, tip, known);
    return this.paint(frame) || changed; // where the way leads from moves with the catheter, which asks for a picture itself
  }

  /** Takes over what the server or the replay says; returns whether anything had to be made anew. */
  private refresh(): boolean {
    const { training, replay } = this.stage;
    const reached = replay.player?.reachedBy() ?? 0;
    if (training.version === this.seenVersion && replay.version === this.seenReplay && reached === this.seenReached) return false;
    this.seenVersion = training.version;
    this.seenReplay = replay.version;
    this.seenReached = reached;
    const { targets, offered } = this.wanted();
    this.group.visible = targets.length > 0;
    this.offered = offered;
    const key = JSON.stringify([targets.map(({ key, state, position_mm, radius_mm }) => [key, state, position_mm, radius_mm]), offered?.key]);
    if (key === this.builtFrom) return false;
    this.builtFrom = key;
    this.build(targets, offered);
    return true;
  }

  /** What is to be shown: the targets of the run that is replayed, else of the trial at hand. */
  private wanted(): { targets: readonly TrainingTarget[]; offered: TrainingTarget | null } {
    const { training, replay } = this.stage;
    const { player } = replay;
    if (player !== null) {
      const by = new Set(player.path.reached.slice(0, player.reachedBy()).map(([key]) => key));
      return { targets: player.path.targets.map((each) => ({ ...each, state: by.has(each.key) ? "reached" : "later" })), offered: null };
    }
    if (!training.atHand) return { targets: [], offered: null };
    return { targets: training.run!.targets, offered: training.target };
  }

  private build(targets: readonly TrainingTarget[], offered: TrainingTarget | null): void {
    this.clear();
    const others = targets.filter(({ key }) => key !== offered?.key);
    this.others = makeOthers(others);
    if (this.others !== null) this.group.add(this.others);
    for (const each of others) {
      if (each.state === "reached") this.addLabel(each, `✓ ${shortName(each.name)}`, LABEL_INK.reached, RANK.place);
      else if (each.state === "missed") this.addLabel(each, `× ${shortName(each.name)}`, LABEL_INK.missed, RANK.place);
    }
    this.mark.ball.visible = this.mark.ring.visible = offered !== null;
    if (offered !== null) {
      this.mark.place(this.at.set(...offered.position_mm), radiusOf(offered));
      this.addLabel(offered, offered.name, LABEL_INK.now, RANK.active);
    }
    this.shownShare = -1;
    this.labelsVersion += 1;
    this.stage.view.resize();
  }

  /** Draws the way that counts: from the tip; from the beam's middle line; across from the image's plane. */
  private pointTo({ kind, position_mm: at }: TrainingTarget): void {
    const x = at[0], y = at[1], z = at[2];
    const m = this.stage.tip.matrix.elements;
    const { measure, mark } = this;
    measureTarget(measure, m, x, y, z, this.array, RANGE_MM);
    let length = measure.distanceMm;
    if (kind === "tip") mark.wayFrom(m[12]!, m[13]!, m[14]!);
    else if (kind === "beam") {
      mark.wayFrom(measure.foot[0]!, measure.foot[1]!, measure.foot[2]!);
      length = measure.beamDistanceMm;
    } else {
      const off = (x - m[12]!) * m[4]! + (y - m[13]!) * m[5]! + (z - m[14]!) * m[6]!;
      mark.wayFrom(x - off * m[4]!, y - off * m[5]!, z - off * m[6]!);
      length = Math.abs(off);
    }
    mark.wayTo(x, y, z, length);
  }

  /** Colours the target by how long it is kept, and fills its ring; returns whether that has changed. */
  private paint(frame: Frame): boolean {
    const { mark: { ball, ring, way }, stage: { view, training } } = this;
    const share = training.now?.progress ?? 0;
    ring.visible = share > 0 && training.phase === "running";
    if (ring.visible) this.mark.fillRing(share, frame, view);
    if (share === this.shownShare) return false;
    this.shownShare = share;
    const colour = ball.material.color;
    if (share > 0) colour.copy(TARGET_COLOURS.near).lerp(TARGET_COLOURS.reached, 0.8 * share);
    else colour.copy(TARGET_COLOURS.open);
    ball.material.opacity = share > 0 ? 0.55 : 0.45;
    way.material.color.copy(colour);
    this.frame.tint(colour);
    return true;
  }

  private addLabel(target: TrainingTarget, words: string, ink: string, rank: typeof RANK.active | typeof RANK.place): void {
    this.labels.add(words, ink, rank, this.at.set(...target.position_mm), radiusOf(target));
  }

  private clear(): void {
    this.labels.clear();
    this.others?.removeFromParent();
    this.others?.dispose();
    this.others?.geometry.dispose();
    this.others?.material.dispose();
    this.others = null;
  }
}

function radiusOf({ kind, radius_mm }: TrainingTarget): number {
  return kind === "plane" ? POINT_MM : radius_mm;
}

/** Returns balls at the targets that are not offered now, all in one go, coloured by what became of them; null for none. */
function makeOthers(targets: readonly TrainingTarget[]): InstancedMesh<SphereGeometry, MeshLambertMaterial> | null {
  if (targets.length === 0) return null;
  const material = new MeshLambertMaterial({ transparent: true, opacity: OTHER_SHARE, depthWrite: false });
  const balls = new InstancedMesh(new SphereGeometry(1, 18, 12), material, targets.length);
  const place = new Matrix4();
  const at = new Vector3();
  const size = new Vector3();
  const turn = new Quaternion();
  targets.forEach((target, i) => {
    balls.setMatrixAt(i, place.compose(at.set(...target.position_mm), turn, size.setScalar(Math.max(1.5, 0.5 * radiusOf(target)))));
    balls.setColorAt(i, target.state === "reached" ? TARGET_COLOURS.reached : target.state === "missed" ? MISSED : TARGET_COLOURS.open);
  });
  balls.renderOrder = BALL_ORDER;
  balls.frustumCulled = false;
  return balls;
}
