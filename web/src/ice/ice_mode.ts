/** ICE mode: the ultrasound picture follows the tip, in the beam and on the panel. */

import { Matrix4, Vector3 } from "three";
import type { SceneDescription } from "../generated/messages";
import { ctFromBox } from "../maths/registration";
import type { Feature, Frame } from "../stage/feature";
import type { SceneSettings } from "../stage/settings";
import type { Stage } from "../stage/stage";
import type { Plate } from "../flat/plate";
import { FanGeometry, IceImager, IcePanel, iceHzFrom } from "../ultrasound";
import { Beam } from "./beam";
import { SteadyPose } from "./steady";
import { tipFromTransducer } from "./transducer";
import type { HeartVolumes } from "./volumes";

/** Pictures after the last change, so that what persists of earlier ones is gone: 0.3 to the power of 5 is 0.2 %. */
const SETTLING = 6;
/** The cut keeps its side until the viewer is this far (mm) on the other one. */
const SIDE_MM = 15;
const RAD = Math.PI / 180;
const NO_LEGEND: readonly (readonly [string, string])[] = [];

export class IceMode implements Feature {
  readonly imager: IceImager;
  readonly panel: IcePanel;
  readonly beam: Beam;
  readonly plate: Plate;
  private readonly steady = new SteadyPose();
  private readonly ctFromBox = new Matrix4();
  private tipFromTransducer = tipFromTransducer(1.5);
  private readonly wanted = new Matrix4();
  private readonly ctFromTransducer = new Matrix4();
  private readonly viewer = new Vector3();
  private readonly point = new Vector3();
  private readonly normal = new Vector3();
  private side = 1;
  private applied: SceneSettings | null = null;
  private volume = -1;
  /** Pictures still to be made before the present one is as it should be. */
  private due = 0;
  /** Whether the shown picture is of this scene. */
  private pictured = false;

  /** Throws Error when the browser cannot draw into half-float pictures. */
  constructor(private readonly stage: Stage, private readonly volumes: HeartVolumes) {
    this.imager = new IceImager(stage.view.renderer, Math.min(30, iceHzFrom(location.search)));
    const shape = new FanGeometry();
    this.beam = new Beam(this.imager, shape);
    this.panel = new IcePanel(this.imager, shape);
    this.plate = { group: this.panel.group, widthM: this.panel.widthM, heightM: this.panel.heightM, title: "Ultrasound (ICE)" };
    stage.view.box.add(this.beam.group);
    if (stage.settings.material === "lambert") this.imager.setSettings({ slices: 1 });
  }

  describe(scene: SceneDescription): void {
    if (scene.heart !== null) ctFromBox(this.ctFromBox, scene.heart.registration);
    this.tipFromTransducer = tipFromTransducer(scene.catheter_diameter_mm / 2);
    this.steady.reset();
    this.pictured = false;
  }

  /** Whether somebody sees a picture of ultrasound: in the beam or on a panel. */
  get shown(): boolean {
    return this.stage.store.value.ice;
  }

  update(frame: Frame): boolean {
    const { store } = this.stage;
    let changed = this.takeVolumes();
    if (store.value !== this.applied) changed = this.apply(store.value) || changed;
    if (!store.value.ice) {
      this.stage.cuts.release("beam");
      return changed;
    }
    changed = this.follow(frame) || changed;
    if (this.due > 0 && this.imager.update(frame.nowMs / 1000)) {
      this.due -= 1;
      this.pictured = true;
      this.placePicture();
      changed = true;
    }
    changed = this.tell(frame) || changed;
    this.cut();
    return this.panel.refresh() || changed;
  }

  dispose(): void {
    this.beam.dispose();
    this.panel.dispose();
    this.imager.dispose();
  }

  private takeVolumes(): boolean {
    if (this.volume === this.volumes.version) return false;
    this.volume = this.volumes.version;
    this.imager.setVolume(this.volumes.acoustic);
    this.pictured = false;
    this.due = SETTLING;
    if (this.applied !== null) this.colour(this.applied.teaching);
    return true;
  }

  /** Takes the settings over; returns whether anything changed. */
  private apply(now: SceneSettings): boolean {
    const before = this.applied;
    this.applied = now;
    const own = this.imager.settings;
    const sectorRad = now.sectorDeg * RAD;
    if (sectorRad !== own.sectorRad || now.depthMm !== own.depthMm || now.gainDb !== own.gainDb || now.frequencyMHz !== own.frequencyMHz) {
      this.imager.setSettings({ sectorRad, depthMm: now.depthMm, gainDb: now.gainDb, frequencyMHz: now.frequencyMHz });
      this.beam.fit();
    }
    if (this.imager.frozen && !now.frozen) this.steady.reset(); // the pose that it has by now
    this.imager.frozen = now.frozen;
    this.panel.distalLeft = now.iceDistalLeft;
    if (before === null || now.teaching !== before.teaching) this.colour(now.teaching);
    if (!now.ice) this.beam.show(false, false, false);
    this.due = SETTLING;
    return true;
  }

  private colour(strength: number): void {
    const { labels, parts } = this.volumes;
    for (const fan of [this.beam.fan, this.panel.fan]) {
      fan.colour(labels, strength);
      fan.setPose(this.ctFromTransducer);
    }
    this.panel.legend = labels !== null && strength > 0 ? parts : NO_LEGEND;
  }

  /** Brings the beam to where the tip is; returns whether it has moved. */
  private follow(frame: Frame): boolean {
    const { tip } = this.stage;
    if (!tip.beam) {
      this.steady.reset();
      return false;
    }
    this.wanted.multiplyMatrices(tip.matrix, this.tipFromTransducer);
    if (!this.steady.follow(this.wanted, frame.dtS)) return false;
    this.beam.place(this.steady.matrix);
    if (!this.imager.frozen) {
      this.ctFromTransducer.multiplyMatrices(this.ctFromBox, this.steady.matrix);
      this.imager.setPose(this.ctFromTransducer);
      this.due = SETTLING;
      if (this.pictured) this.beam.placePicture(this.steady.matrix);
    }
    return true;
  }

  /** The picture is where it was made: the colours and the fan in the scene must not move on without it. */
  private placePicture(): void {
    this.beam.placePicture(this.steady.matrix);
    this.beam.fan.setPose(this.ctFromTransducer);
    this.panel.fan.setPose(this.ctFromTransducer);
  }

  /** Shows what there is, and says on the panel what there is not. */
  private tell(frame: Frame): boolean {
    const { tip } = this.stage;
    const message = this.reason(frame);
    const changed = message !== this.panel.message;
    this.panel.message = message;
    const picture = this.pictured && this.volumes.acoustic !== null && (tip.beam || this.imager.frozen);
    this.beam.show(tip.beam, picture, frame.track !== null && (frame.track.status === "coasting" || frame.track.stale));
    return changed;
  }

  private reason(frame: Frame): string {
    if (this.volumes.acoustic === null) return this.volumes.trouble;
    if (this.imager.frozen && this.pictured) return "";
    if (!this.stage.tip.valid) {
      return frame.track === null ? "There is no tracked catheter: nothing to show."
        : "The catheter is lost: there is no picture until it is seen again.";
    }
    if (!this.stage.tip.beam) return "Roll is not known, and with it where the beam looks. Set roll zero (or connect the encoder) for a picture.";
    return "";
  }

  /** Gives the beam's plane to whoever cuts by it: what lies between it and the viewer is taken away. */
  private cut(): void {
    const { view, cuts, tip } = this.stage;
    if (!tip.beam) {
      cuts.release("beam");
      return;
    }
    this.viewer.copy(view.immersive ? view.head.position : view.camera.position);
    view.box.worldToLocal(this.viewer);
    this.point.setFromMatrixPosition(this.steady.matrix);
    this.normal.setFromMatrixColumn(this.steady.matrix, 1);
    const before = this.viewer.sub(this.point).dot(this.normal) * this.side;
    if (before < -SIDE_MM) this.side = -this.side;
    cuts.set("beam", this.point, this.normal.multiplyScalar(this.side));
  }
}
