/** What tests and curious people can ask about the headset's session. */

import { Vector3 } from "three";
import type { SceneSettings, SettingsStore } from "../stage/settings";
import type { Immersion } from "./immersion";
import type { Tab } from "./menu_model";
import type { Placement } from "./placement";
import type { XrMode, XrPhase } from "./sessions";

type Triple = [number, number, number];

export interface XrReport {
  readonly mode: XrMode | null;
  readonly phase: XrPhase;
  /** Frames of this session so far. */
  readonly frames: number;
  /** Whether the world has been put before the viewer. */
  readonly settled: boolean;
  readonly head: Triple;
  readonly world: { readonly position: Triple; readonly orientation: readonly number[]; readonly scale: number };
  /** Whether the world is on its way to where it was sent. */
  readonly travelling: boolean;
  readonly menu: { readonly open: boolean; readonly tab: string };
  readonly notice: string;
  readonly hud: string;
  /** This page's work in a frame, and the time from one frame to the next, ms. */
  readonly workMs: { readonly p50: number; readonly p95: number };
  readonly intervalMs: { readonly p50: number; readonly p95: number };
  /** Of the last frame, both eyes together. */
  readonly calls: number;
  readonly triangles: number;
}

export interface XrDebug {
  report(): XrReport;
  settings(): SceneSettings;
  /** Where a row of the open menu is pressed, m in the room; null where there is none. */
  row(label: string): Triple | null;
  tab(tab: Tab): void;
  /** The heart's middle, m in the world's own frame, as it was found last. */
  centre(): Triple;
  /** What a hand holds with, m in the room; null where there is no such hand. */
  holder(side: "left" | "right"): Triple | null;
  background(): string | null;
  clearTimes(): void;
  go(placement: Placement): void;
  enter(mode: XrMode): Promise<void>;
  leave(): void;
  set: SettingsStore["set"];
  hold: SettingsStore["hold"];
}

export function xrDebug(immersion: Immersion, store: SettingsStore): XrDebug {
  return {
    report: () => immersion.report(),
    settings: () => store.value,
    row: (label) => {
      const place = immersion.menu.whereIs(label);
      if (place === null || !immersion.menu.visible) return null;
      const { widthM, heightM, group } = immersion.menu;
      const point = new Vector3((place[0] - 0.5) * widthM, (place[1] - 0.5) * heightM, 0).applyMatrix4(group.matrixWorld);
      return point.toArray() as Triple;
    },
    tab: (tab) => immersion.menu.show(tab),
    centre: () => immersion.places.centre.toArray(),
    holder: (side) => immersion.pointers.find((each) => each.source?.handedness === side)?.position.toArray() ?? null,
    background: () => immersion.background,
    clearTimes: () => immersion.clearTimes(),
    go: (placement) => immersion.go(placement),
    enter: (mode) => immersion.sessions.enter(mode),
    leave: () => immersion.sessions.leave(),
    set: (change) => store.set(change),
    hold: (lock) => store.hold(lock),
  };
}
