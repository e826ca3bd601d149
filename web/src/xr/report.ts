/** What tests and curious people can ask about the headset's session. */

import { Layers, Line, Mesh, Sprite, Vector3 } from "three";
import type { Object3D } from "three";
import type { Plate } from "../flat/plate";
import type { SceneSettings, SettingsStore } from "../stage/settings";
import type { Immersion } from "./immersion";
import type { Tab } from "./menu_model";
import type { Placement } from "./placement";
import type { XrMode, XrPhase } from "./sessions";

const SEEN = new Layers();
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
  row(label: string, segment?: number): Triple | null;
  /** What the rows of the open menu say first. */
  rows(): string[];
  tab(tab: Tab): void;
  /** The heart's middle, m in the world's own frame, as it was found last. */
  centre(): Triple;
  /** Every plate that is shown: its name and its corners in the room, m, round from the lower left. */
  plates(): { title: string; corners: Triple[] }[];
  /** Where a point of `box`, mm, is drawn in the room, m. */
  room(box: Triple): Triple;
  /** What a hand holds with, m in the room; null where there is no such hand. */
  holder(side: "left" | "right"): Triple | null;
  background(): string | null;
  clearTimes(): void;
  /** What stands in the scene to be drawn now, each by the names from the scene down; what is out of view too. */
  drawables(): string[];
  go(placement: Placement): void;
  /** Begins the guide, where there is one. */
  guide(): void;
  enter(mode: XrMode): Promise<void>;
  leave(): void;
  set: SettingsStore["set"];
  hold: SettingsStore["hold"];
}

export function xrDebug(immersion: Immersion, store: SettingsStore): XrDebug {
  return {
    report: () => immersion.report(),
    settings: () => store.value,
    row: (label, segment) => {
      const place = immersion.menu.whereIs(label, segment);
      if (place === null || !immersion.menu.visible) return null;
      const { widthM, heightM, group } = immersion.menu;
      const point = new Vector3((place[0] - 0.5) * widthM, (place[1] - 0.5) * heightM, 0).applyMatrix4(group.matrixWorld);
      return point.toArray() as Triple;
    },
    rows: () => immersion.menu.labels,
    tab: (tab) => immersion.menu.show(tab),
    centre: () => immersion.places.centre.toArray(),
    plates: () => immersion.shownPlates().map((plate) => ({ title: plate.title, corners: corners(plate) })),
    room: (box) => immersion.roomFromBox(new Vector3(...box)).toArray(),
    holder: (side) => immersion.pointers.find((each) => each.source?.handedness === side)?.position.toArray() ?? null,
    background: () => immersion.background,
    clearTimes: () => immersion.clearTimes(),
    drawables: () => drawables(immersion.scene),
    guide: () => immersion.acts.guide?.(),
    go: (placement) => immersion.go(placement),
    enter: (mode) => immersion.sessions.enter(mode),
    leave: () => immersion.sessions.leave(),
    set: (change) => store.set(change),
    hold: (lock) => store.hold(lock),
  };
}

function drawables(root: Object3D): string[] {
  const found: string[] = [];
  root.traverseVisible((node) => {
    if (!(node instanceof Mesh || node instanceof Line || node instanceof Sprite) || !node.layers.test(SEEN)) return;
    const names: string[] = [];
    for (let each: Object3D | null = node; each !== null && each !== root; each = each.parent) names.unshift(each.name || each.type);
    found.push(names.join("/"));
  });
  return found;
}

function corners({ group, widthM, heightM }: Plate): Triple[] {
  group.updateWorldMatrix(true, false);
  return [[-1, -1], [1, -1], [1, 1], [-1, 1]].map(([x, y]) =>
    new Vector3((x! * widthM) / 2, (y! * heightM) / 2, 0).applyMatrix4(group.matrixWorld).toArray());
}
