/** What tests can ask about the scene. */

import type { Stagecraft } from "./stagecraft";
import type { TargetReadout, WallReadout } from "./target_readout";

export interface SceneReport {
  readonly target: TargetReadout | null;
  readonly targets: readonly { readonly id: string; readonly name: string; readonly positionMm: readonly number[]; readonly own: boolean }[];
  readonly wall: WallReadout;
  /** How far behind the world the drawing is, and how much of that is waiting for Tracks, ms. */
  readonly delayMs: number | null;
  readonly waitMs: number;
  readonly extrapolated: boolean;
  readonly stale: boolean;
  /** Whether the view from the tip has a picture. */
  readonly endoscope: boolean;
  /** Of the last frame. */
  readonly calls: number;
  readonly triangles: number;
  readonly geometries: number;
  readonly textures: number;
}

/** Returns the present figures, as a copy. */
export function sceneReport({ stage, track, motion, view }: Stagecraft): SceneReport {
  const { readout, targets, endoscope } = stage;
  const { memory } = view.renderer.info;
  return {
    target: readout.target === null ? null : { ...readout.target },
    targets: targets.targets.map(({ id, name, position, own }) => ({ id, name, positionMm: position.toArray(), own })),
    wall: { ...readout.wall },
    delayMs: track?.delayMs ?? null,
    waitMs: motion.waitMs,
    extrapolated: track?.extrapolated ?? false,
    stale: track?.stale ?? false,
    endoscope: endoscope.active && endoscope.wanted,
    calls: view.drawn.calls,
    triangles: view.drawn.triangles,
    geometries: memory.geometries,
    textures: memory.textures,
  };
}
