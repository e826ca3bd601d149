/** Makes what shows flat pictures: ultrasound, fluoroscopy, and where they stand. */

import { IceMode } from "../ice/ice_mode";
import { HeartVolumes } from "../ice/volumes";
import type { TipView } from "../scene/endoscope";
import type { Feature } from "../stage/feature";
import type { Stage } from "../stage/stage";
import { toast } from "../ui/toasts";
import { FlatView } from "./flat_view";
import { makeProbe } from "./probe";

/** Returns the features, volumes first. tipView: the view from the tip, where there is one. */
export function makeFlatFeatures(stage: Stage, tipView: TipView | null): Feature[] {
  const volumes = new HeartVolumes(stage.settings.heart);
  try {
    const ice = new IceMode(stage, volumes);
    const flat = new FlatView(stage, ice, volumes, tipView);
    window.__cathxrFlat = makeProbe(stage, ice, flat);
    return [volumes, ice, flat];
  } catch (error) {
    toast(`There is no ultrasound and no 2D view: ${error instanceof Error ? error.message : "unknown reason"}`, "bad");
    return [];
  }
}
