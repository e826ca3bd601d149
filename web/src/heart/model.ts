/** What the page shows and how: the server's state, and what this page alone decides. */

import type { HeartSeed, HeartSeedsState, HeartStructure, SlicePlane, Vector3 } from "../generated/messages";
import type { PlaneName } from "./geometry";
import { kept, PLANES, shapeOf, sliceAt } from "./geometry";
import type { Window } from "./paint";
import { labelTable, PRESETS, windowTable } from "./paint";

export type Tool = "point" | "window" | "move";
export type Overlay = "fill" | "outline" | "off";

export class SeedsModel {
  state: HeartSeedsState | null = null;
  /** Where the three planes cross, seen coordinates. */
  cursor: Vector3 = [0, 0, 0];
  /** The structure that a click makes a seed of; null: clicks only look. */
  chosen: string | null = null;
  selected: number | null = null;
  tool: Tool = "point";
  overlay: Overlay = "fill";
  opacity = 0.4;
  /** The next click adds a seed in place of moving the structure's own. */
  adding = false;
  large: PlaneName = "axial";
  readonly hidden = new Set<string>();
  private shown: Window = PRESETS[0]!.window;
  private grey: Uint32Array | null = null;
  private colours: Uint32Array | null = null;

  /** `onLook` is called after each change that is seen in the slices alone, `onChange` after all others. */
  constructor(private readonly onLook: () => void, private readonly onChange: () => void) {}

  take(state: HeartSeedsState): void {
    const first = this.state === null || JSON.stringify(this.state.planes) !== JSON.stringify(state.planes);
    if (JSON.stringify(this.state?.structures) !== JSON.stringify(state.structures)) this.colours = null;
    this.state = state;
    if (first) this.cursor = shapeOf(state.planes).map((count) => Math.floor((count - 1) / 2)) as unknown as Vector3;
    if (this.selected !== null && this.seed(this.selected) === null) this.selected = null;
    this.onChange();
  }

  change(): void {
    this.colours = null;
    this.onChange();
  }

  get window(): Window {
    return this.shown;
  }

  set window(window: Window) {
    this.shown = window;
    this.grey = null;
    this.onChange();
  }

  get greyTable(): Uint32Array {
    return (this.grey ??= windowTable(this.shown));
  }

  /** The pixel of each label that is to be seen. */
  get labelTable(): Uint32Array {
    return (this.colours ??= labelTable(this.visible()));
  }

  /** Returns the colours of the labels that are to be seen. */
  visible(): Map<number, string> {
    const seen = (this.state?.structures ?? []).filter((each) => each.label !== 0 && !this.hidden.has(each.key));
    return new Map(seen.map((each) => [each.label, each.colour]));
  }

  plane(name: PlaneName): SlicePlane | null {
    return this.state?.planes.find((plane) => plane.name === name) ?? null;
  }

  slice(name: PlaneName): number {
    return this.state === null ? 0 : sliceAt(name, this.cursor, shapeOf(this.state.planes));
  }

  structure(key: string): HeartStructure | null {
    return this.state?.structures.find((each) => each.key === key) ?? null;
  }

  seed(id: number): HeartSeed | null {
    return this.state?.seeds.find((each) => each.id === id) ?? null;
  }

  seedsOf(structure: string): HeartSeed[] {
    return this.state?.seeds.filter((each) => each.structure === structure) ?? [];
  }

  /** Returns the structures that a seed may name, in the order of their keys 1 to 9. */
  seedable(): HeartStructure[] {
    return this.state?.structures.filter((each) => each.seedable) ?? [];
  }

  nameOf(key: string): string {
    return this.structure(key)?.name ?? key;
  }

  /** Moves the cursor; it stays within the scan. */
  look(cursor: Vector3): void {
    if (this.state === null) return;
    this.cursor = kept(cursor, shapeOf(this.state.planes));
    this.onLook();
  }

  choose(structure: string | null): void {
    this.chosen = structure;
    this.selected = structure === null ? null : this.seedsOf(structure).at(-1)?.id ?? null;
    this.adding = false;
    this.onChange();
  }

  /** Takes hold of a seed and looks at it. */
  select(seed: HeartSeed): void {
    this.chosen = seed.structure;
    this.selected = seed.id;
    this.adding = false;
    this.look(seed.seen);
    this.onChange();
  }

  /** Returns the seeds that are seen in the present slice of a plane, with how many slices each lies off. */
  seedsNear(name: PlaneName): { seed: HeartSeed; off: number }[] {
    const plane = this.plane(name);
    if (plane === null || this.state === null) return [];
    const axis = { axial: 2, coronal: 1, sagittal: 0 }[name];
    const slice = this.slice(name);
    return this.state.seeds
      .map((seed) => ({ seed, off: Math.abs(seed.seen[axis]! - slice) }))
      .filter(({ off }) => off * plane.spacing_mm[2] <= NEAR_MM || off <= 0.5);
  }
}

/** Seeds this near to a slice are hinted at in it. */
export const NEAR_MM = 6;

/** Returns the plane after (or before) another, round and round. */
export function planeAfter(name: PlaneName, step: number): PlaneName {
  return PLANES[(PLANES.indexOf(name) + step + PLANES.length) % PLANES.length]!;
}
