/** The target of the guide: near the tip, where pushing or pulling leads, so that everybody reaches it. */

import { Vector3 } from "three";
import type { ReachRule } from "../maths/target";
import type { DrawnTrack } from "../motion/drawn";
import type { Target } from "../scene/target_book";
import type { Stage } from "../stage/stage";
import { direction } from "./bend";

export const PRACTICE_NAME = "Practice target";
/** Any direction will do: to be there is enough for a beginning. */
const RULE: ReachRule = { radiusMm: 5, angleDeg: 180, dwellS: 1 };
const AWAY_MM = 18;
/** Pushing moves the bent end as a whole along the piece behind it. */
const BEND_MM = 60;
const CHORD_MM = 6;
/** Nearer than this to where the catheter can no longer be pushed, the target lies behind. */
const ROOM_MM = 8;

const along = new Float64Array(3);

export class Practice {
  private target: Target | null = null;
  private readonly point = new Vector3();

  constructor(private readonly stage: Stage) {}

  /** Places the target before the tip, or behind it where there is no room: within `mostMm` of the box and of insertion. */
  place(track: DrawnTrack, insertedMm: number, mostXMm: number, mostInsertedMm: number): void {
    this.remove();
    direction(along, track.points, track.count, Math.max(0, Math.min(BEND_MM, insertedMm - CHORD_MM)), CHORD_MM);
    const { tip } = track;
    const room = Math.min(mostInsertedMm - insertedMm, (mostXMm - tip[0]!) / Math.max(0.2, along[0]!));
    const way = room > AWAY_MM + ROOM_MM ? AWAY_MM : -AWAY_MM;
    this.point.set(tip[0]! + way * along[0]!, tip[1]! + way * along[1]!, tip[2]! + way * along[2]!);
    this.target = this.stage.targets.addPassing(this.point, PRACTICE_NAME, RULE);
  }

  get placed(): boolean {
    return this.target !== null;
  }

  remove(): void {
    if (this.target !== null) this.stage.targets.remove(this.target.id);
    this.target = null;
  }
}
