/** The figures about targets and wall: written by the features that know them, read by HUD and page. */

import type { SceneReadout, TargetReadout, WallReadout } from "./target_readout";

type Writable<T> = { -readonly [K in keyof T]: T[K] };

export class Readout implements SceneReadout {
  target: TargetReadout | null = null;
  readonly wall: Writable<WallReadout> = { state: "off", count: 0, depthMm: 0 };
}
