/** Everything that stands in the scene, rebuilt when the server describes another one. */

import { Group, Matrix4, Vector3 } from "three";
import type { SceneDescription, TrackMessage } from "../generated/messages";
import type { DrawnTrack } from "../motion/drawn";
import { Interpolator } from "../motion/interpolator";
import type { Settings } from "../settings";
import type { Feature, Frame } from "../stage/feature";
import { makeFeatures } from "../stage/features";
import type { SettingsStore } from "../stage/settings";
import type { Stage } from "../stage/stage";
import { pageStorage } from "../stage/storage";
import { TrainingModel } from "../training/model";
import { Replay } from "../training/replay";
import { toast } from "../ui/toasts";
import { Catheter } from "./catheter";
import { CutPlanes } from "./cut_planes";
import { EndoscopePicture } from "./endoscope";
import { Heart } from "./heart";
import { Presets } from "./presets";
import { Readout } from "./readout";
import { disposeRoi, makeRoi } from "./roi";
import { TargetBook } from "./target_book";
import { Tip } from "./tip";
import { View } from "./view";

/** A longer gap between frames is a hidden page: things do not move on by all of it. */
const LONGEST_STEP_S = 0.1;

export class Stagecraft {
  readonly view: View;
  /** Holds `box`; moved, turned and scaled as a whole. */
  readonly world = new Group();
  readonly catheter: Catheter;
  readonly heart: Heart;
  readonly presets: Presets;
  readonly motion = new Interpolator();
  readonly stage: Stage;
  readonly features: Feature[] = [];
  private readonly tip = new Tip();
  private readonly frameNow: { -readonly [K in keyof Frame]: Frame[K] } = { nowMs: 0, dtS: 0, track: null, immersive: false };
  private fixtures: Group[] = [];
  private described: SceneDescription | null = null;
  private describedUrl = "";

  /** Throws Error when the browser gives no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, settings: Settings, store: SettingsStore) {
    this.view = new View(canvas, settings);
    this.world.name = "world";
    this.view.scene.add(this.world);
    this.world.add(this.view.box);
    this.catheter = new Catheter(settings);
    this.heart = new Heart(settings);
    this.view.box.add(this.catheter.group, this.heart.group);
    this.presets = new Presets(this.view);
    this.stage = {
      view: this.view,
      store,
      settings,
      world: this.world,
      heart: this.heart,
      catheter: this.catheter,
      presets: this.presets,
      tip: this.tip,
      cuts: new CutPlanes(),
      readout: new Readout(),
      endoscope: new EndoscopePicture(settings),
      targets: new TargetBook(pageStorage()),
      training: new TrainingModel(),
      replay: new Replay(() => this.stage.training.change(), (sentence) => toast(sentence, "bad")),
      plates: [],
      blood: null,
    };
    const follow = (): void => {
      this.catheter.pointing = !store.value.ice; // the beam itself says where it looks
      this.view.touch();
    };
    store.listen(follow);
    follow();
    for (const feature of makeFeatures(this.stage)) this.add(feature);
  }

  /** Takes a feature in, after those that are there. */
  add(feature: Feature): void {
    this.features.push(feature);
    if (this.described !== null) void feature.describe?.(this.described, this.describedUrl);
  }

  /** Builds what a scene describes, the heart apart. */
  describe(scene: SceneDescription, sceneUrl: string): void {
    for (const fixture of this.fixtures) disposeRoi(fixture);
    this.described = scene;
    this.describedUrl = sceneUrl;
    this.fixtures = [makeRoi(scene)];
    this.view.box.add(...this.fixtures);
    this.catheter.describe(scene.catheter_diameter_mm, scene.roi_min_mm[2]);
    this.presets.describe(scene);
    this.stage.targets.describe(scene);
    for (const feature of this.features) void feature.describe?.(scene, sceneUrl);
    this.view.resize();
  }

  /** Takes a Track as it comes. */
  take(track: TrackMessage, nowMs: number): void {
    this.motion.put(track, nowMs / 1000);
  }

  /** Forgets the Tracks of a link that has ended. */
  forget(): void {
    this.motion.forget();
  }

  /**
   * Brings everything up to date and draws the frame. Called once for each animation frame, in a headset's session too.
   *
   * offsetS: the host's clock minus the page's, null while unknown.
   */
  frame(nowMs: number, offsetS: number | null): void {
    const frame = this.frameNow;
    frame.dtS = Math.min(LONGEST_STEP_S, Math.max(0, (nowMs - frame.nowMs) / 1000));
    frame.nowMs = nowMs;
    frame.immersive = this.view.immersive;
    frame.track = this.described === null ? null : this.motion.sample(nowMs / 1000, offsetS);
    let changed = this.catheter.update(frame.track);
    this.tip.update(frame.track);
    for (const feature of this.features) changed = feature.update(frame) || changed;
    if (changed) this.view.touch();
    if (!frame.immersive) this.presets.update(nowMs, this.catheter.shown ? this.catheter.line : null);
    this.view.draw(nowMs);
  }

  /** What is drawn now, for the page's figures; null before the first Track. */
  get track(): DrawnTrack | null {
    return this.frameNow.track;
  }

  /**
   * Returns what is drawn: the number of the newest Track in it, the instant that it shows (seconds of the host's clock),
   * the tip, mm in `box`, from what is on the graphics card, and whether the beam is drawn; null while no catheter is.
   */
  drawn(): { seq: number; t: number; tip: [number, number, number]; beam: boolean } | null {
    const { catheter, view } = this;
    if (!catheter.shown) return null;
    view.box.updateWorldMatrix(true, false);
    const boxFromScene = new Matrix4().copy(view.box.matrixWorld).invert();
    const tip = catheter.drawnTip(boxFromScene, new Vector3());
    return { seq: catheter.seq, t: catheter.t, tip: [tip.x, tip.y, tip.z], beam: catheter.beam };
  }
}
