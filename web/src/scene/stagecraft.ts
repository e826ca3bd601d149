/** Everything that stands in the scene, rebuilt when the server describes another one. */

import type { Group } from "three";
import { Matrix4, Vector3 } from "three";
import type { SceneDescription, TrackMessage } from "../generated/messages";
import type { Settings } from "../settings";
import { Catheter } from "./catheter";
import { Heart } from "./heart";
import { Presets } from "./presets";
import { disposeRoi, makeRoi } from "./roi";
import { makeTargets } from "./targets";
import { View } from "./view";

export class Stagecraft {
  readonly view: View;
  readonly catheter: Catheter;
  readonly heart: Heart;
  readonly presets: Presets;
  private fixtures: Group[] = [];
  private targets: Group | null = null;
  private shown: TrackMessage | null = null;

  /** Throws Error when the browser gives no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, settings: Settings) {
    this.view = new View(canvas, settings);
    this.catheter = new Catheter(settings);
    this.heart = new Heart(settings);
    this.view.box.add(this.catheter.group, this.heart.group);
    this.presets = new Presets(this.view);
  }

  /** Builds what a scene describes, the heart apart. */
  describe(scene: SceneDescription): void {
    for (const fixture of this.fixtures) disposeRoi(fixture);
    this.targets = makeTargets(scene.targets);
    this.fixtures = [makeRoi(scene), this.targets];
    this.view.box.add(...this.fixtures);
    this.catheter.describe(scene.catheter_diameter_mm, scene.roi_min_mm[2]);
    this.shown = null;
    this.presets.describe(scene);
    this.view.resize();
  }

  /** Shows or hides the places to reach. */
  showTargets(visible: boolean): void {
    if (this.targets !== null) this.targets.visible = visible;
    this.view.touch();
  }

  /** Draws the newest Track, if it is not drawn yet, and the frame. Called once for each animation frame. */
  frame(nowMs: number, newest: TrackMessage | null): void {
    if (newest !== this.shown) {
      this.shown = newest;
      if (newest === null) this.catheter.hide();
      else this.catheter.update(newest);
      this.view.touch();
    }
    this.presets.update(nowMs, this.catheter.seq < 0 ? null : this.catheter.line);
    this.view.draw(nowMs);
  }

  /**
   * Returns the drawn Track's number and tip, mm in `box`, from what is on the graphics card, and whether its beam is
   * drawn; null while no catheter is.
   */
  drawn(): { seq: number; tip: [number, number, number]; beam: boolean } | null {
    if (this.catheter.seq < 0) return null;
    this.view.box.updateWorldMatrix(true, false);
    const boxFromScene = new Matrix4().copy(this.view.box.matrixWorld).invert();
    const tip = this.catheter.drawnTip(boxFromScene, new Vector3());
    return { seq: this.catheter.seq, tip: [tip.x, tip.y, tip.z], beam: this.catheter.beam };
  }
}
