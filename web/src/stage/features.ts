/** All features of the scene, in the order in which they are brought up to date. */

import { Declutter } from "../scene/declutter";
import { Endoscope } from "../scene/endoscope";
import { HeartLook } from "../scene/heart_look";
import { PageReadout } from "../scene/page_readout";
import { Targets } from "../scene/targets";
import { Wall } from "../scene/wall";
import { makeFlatFeatures } from "../flat/make";
import { Ghost } from "../training/scene/ghost";
import { RunMarks } from "../training/scene/marks";
import type { Feature } from "./feature";
import type { Stage } from "./stage";

/** Returns the features of a stage. The catheter and the tip are up to date before the first of them. */
export function makeFeatures(stage: Stage): Feature[] {
  const targets = new Targets(stage);
  const marks = new RunMarks(stage);
  return [
    new HeartLook(stage),
    targets,
    new Ghost(stage), // before the marks: it moves the run on
    marks,
    new Declutter(stage, [targets, marks]),
    new Wall(stage),
    new PageReadout(stage),
    new Endoscope(stage),
    ...makeFlatFeatures(stage, stage.endoscope),
  ];
}
