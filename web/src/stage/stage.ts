/** What a feature may take hold of: the scene's places and things, made once and kept. */

import type { Group } from "three";
import type { Plate } from "../flat/plate";
import type { Catheter } from "../scene/catheter";
import type { CutPlanes } from "../scene/cut_planes";
import type { EndoscopePicture } from "../scene/endoscope";
import type { Heart } from "../scene/heart";
import type { Presets } from "../scene/presets";
import type { Readout } from "../scene/readout";
import type { TargetBook } from "../scene/target_book";
import type { View } from "../scene/view";
import type { Settings } from "../settings";
import type { TipPose } from "./feature";
import type { TrainingModel } from "../training/model";
import type { Replay } from "../training/replay";
import type { Blood } from "../xr/standpoint";
import type { SettingsStore } from "./settings";

/** scene > world > box: `world` is moved, turned and scaled as a whole; `box` is mm, turned so that y is up in the scene. */
export interface Stage {
  readonly view: View;
  readonly store: SettingsStore;
  /** How finely to draw, from the page's address. */
  readonly settings: Settings;
  readonly world: Group;
  readonly heart: Heart;
  readonly catheter: Catheter;
  readonly presets: Presets;
  readonly tip: TipPose;
  readonly cuts: CutPlanes;
  /** Figures about target and wall, for HUD and page. */
  readonly readout: Readout;
  readonly endoscope: EndoscopePicture;
  readonly targets: TargetBook;
  /** How the trial stands whose targets are in the scene. */
  readonly training: TrainingModel;
  /** The run that is shown again. */
  readonly replay: Replay;
  /** Pictures that stand in a headset's room now: to be pointed at and moved. */
  readonly plates: Plate[];
  /** Where the blood is; null until that is known. Set by the wall's feature. */
  blood: Blood | null;
}
