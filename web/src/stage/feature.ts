/** What stands in the scene is made of features: each takes what it needs from the frame and looks after its own things. */

import type { Matrix4 } from "three";
import type { SceneDescription } from "../generated/messages";
import type { DrawnTrack } from "../motion/drawn";

/** One frame, as every feature is given it. The same object each time: nothing of it is to be kept. */
export interface Frame {
  readonly nowMs: number;
  /** Since the last frame; at most 0.1. */
  readonly dtS: number;
  /** What is drawn now: between the last Tracks; null before the first. `stale` while the link is down. */
  readonly track: DrawnTrack | null;
  /** Whether a headset's session runs. */
  readonly immersive: boolean;
}

/** Called in the order of `features.ts`: motion first, then what follows it. */
export interface Feature {
  /** Takes a new scene; may be called again with another. */
  describe?(scene: SceneDescription, sceneUrl: string): void | Promise<void>;
  /** Brings itself up to date; returns whether the picture has changed. Allocates nothing. */
  update(frame: Frame): boolean;
  dispose?(): void;
}

/** Where the tip's own things hang: mm in `box`, the tip's position and orientation. */
export interface TipPose {
  /** box_from_tip, mm. */
  readonly matrix: Matrix4;
  readonly valid: boolean;
  /** Whether roll is known, and with it where the beam looks. */
  readonly beam: boolean;
}
