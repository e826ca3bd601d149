/** The watch over the target in force: how far the tip and the beam are from it, and whether it is reached. */

import type { Matrix4 } from "three";
import { ARRAY_BEHIND_TIP_MM } from "../ice/transducer";
import type { ReachBy, TargetMeasure } from "../maths/target";
import { Dwell, makeTargetMeasure, measureTarget, REACH_RULE } from "../maths/target";
import type { DrawnTrack } from "../motion/drawn";
import type { Target } from "./target_book";
import type { TargetReadout } from "./target_readout";

/** Between two drawn instants further apart than this nothing is known. */
const GAP_S = 0.5;

/** What the watch looks with. */
export interface Looking {
  /** box_from_tip, mm. */
  readonly matrix: Matrix4;
  /** Whether roll is known, and with it where the beam looks. */
  readonly beam: boolean;
}

/**
 * A target is reached by the tip or by the beam: as its own rule says; where it has none, by the beam if the ultrasound
 * was on when the watch over it began, else by the tip. Time is the Tracks' own, so that a paused recording does not
 * reach anything; instants of coasting Tracks, which are predictions, do not count and do not interrupt.
 */
export class TargetWatch {
  readonly dwell = new Dwell();
  readonly figures: { -readonly [K in keyof TargetReadout]: TargetReadout[K] } = {
    name: "", by: "tip", distanceMm: 0, angleDeg: 0, beamDistanceMm: null, beamAngleDeg: null,
    near: false, aligned: false, within: false, dwelt: 0, reached: false,
  };
  private readonly measure: TargetMeasure = makeTargetMeasure();
  /** Middle of the array's face in the tip's frame, mm. */
  private readonly array: [number, number, number] = [1.5, 0, -ARRAY_BEHIND_TIP_MM];
  private watched = "";
  private lastT = NaN;

  describe(diameterMm: number): void {
    this.array[0] = diameterMm / 2;
    this.restart();
  }

  /** Begins anew: the present target counts as not reached. */
  restart(): void {
    this.watched = "";
    this.interrupt();
  }

  /** Says that the tip is not known now. */
  interrupt(): void {
    this.dwell.interrupt();
    this.lastT = NaN;
  }

  get by(): ReachBy {
    return this.figures.by;
  }

  /** The place on the beam's middle line that is nearest to the target, mm, `box`. */
  get foot(): Float64Array {
    return this.measure.foot;
  }

  /** Takes what is drawn now; returns whether the target is reached with it. ice: whether the ultrasound is on. */
  step(target: Target, looking: Looking, track: DrawnTrack, ice: boolean, depthMm: number): boolean {
    const { measure, figures, dwell } = this;
    if (target.id !== this.watched) this.begin(target, ice);
    const { x, y, z } = target.position;
    measureTarget(measure, looking.matrix.elements, x, y, z, this.array, depthMm);
    const dt = track.t - this.lastT;
    if (dt < 0 || dt > GAP_S) dwell.interrupt();
    this.lastT = track.t;
    const counted = dt > 0 && track.status === "tracked" && !track.stale ? dt : 0;
    let reached = false;
    if (figures.by === "tip") reached = dwell.step(measure.distanceMm, measure.angleDeg, counted);
    else if (looking.beam) reached = dwell.step(measure.beamDistanceMm, measure.beamAngleDeg, counted);
    else dwell.interrupt();
    this.tell(looking.beam);
    return reached;
  }

  private begin(target: Target, ice: boolean): void {
    this.watched = target.id;
    this.figures.name = target.name;
    this.figures.by = target.rule === undefined ? (ice ? "beam" : "tip") : target.rule.by ?? "tip";
    this.dwell.rule = target.rule ?? { ...REACH_RULE, radiusMm: target.radiusMm, by: this.figures.by };
    this.dwell.clear();
    this.lastT = NaN;
  }

  private tell(beam: boolean): void {
    const { measure, figures, dwell } = this;
    figures.distanceMm = measure.distanceMm;
    figures.angleDeg = measure.angleDeg;
    figures.beamDistanceMm = beam ? measure.beamDistanceMm : null;
    figures.beamAngleDeg = beam ? measure.beamAngleDeg : null;
    figures.near = dwell.near;
    figures.aligned = dwell.aligned;
    figures.within = dwell.within;
    figures.dwelt = dwell.share;
    figures.reached = dwell.reached;
  }
}
