/** Which markers there are, which one is being worked on, and where a person is moving it. */

import type { MarkersState, MarkerState, Vector2 } from "../generated/messages";
import type { Size } from "./fit";

/** A marker in one camera's picture: both cameras may see the same one. */
export type MarkerKey = string;

export interface ShownMarker extends MarkerState {
  readonly key: MarkerKey;
  /** Whether the server has not yet said that it is there. */
  readonly moving: boolean;
}

export function keyOf(marker: Pick<MarkerState, "camera" | "name">): MarkerKey {
  return `${marker.camera}/${marker.name}`;
}

export class MarkerModel {
  state: MarkersState | null = null;
  selected: MarkerKey | null = null;
  private readonly moved = new Map<MarkerKey, Vector2>();

  take(state: MarkersState): void {
    this.state = state;
    if (this.selected !== null && this.find(this.selected) === null) this.selected = null;
  }

  get cameras(): string[] {
    return Object.keys(this.state?.sizes_px ?? {});
  }

  size(camera: string): Size {
    const [width, height] = this.state?.sizes_px[camera] ?? [16, 9];
    return { width, height };
  }

  /** Returns a camera's markers as they are shown: where a person moves them, else where the server has them. */
  of(camera: string): ShownMarker[] {
    return (this.state?.markers ?? []).filter((marker) => marker.camera === camera).map((marker) => this.shown(marker));
  }

  find(key: MarkerKey): ShownMarker | null {
    const marker = this.state?.markers.find((each) => keyOf(each) === key);
    return marker === undefined ? null : this.shown(marker);
  }

  /** Shows a marker at a place that the server has not confirmed yet. */
  move(key: MarkerKey, pixel: Vector2): void {
    this.moved.set(key, pixel);
  }

  /** Shows a marker where the server has it. */
  release(key: MarkerKey): void {
    this.moved.delete(key);
  }

  releaseAll(): void {
    this.moved.clear();
  }

  /** Returns the next marker of that camera that has no place, after `key` in the list and then from its beginning. */
  nextMissing(key: MarkerKey): MarkerKey | null {
    const marker = this.find(key);
    if (marker === null) return null;
    const all = this.of(marker.camera);
    const at = all.findIndex((each) => each.key === key);
    const next = [...all.slice(at + 1), ...all.slice(0, at)].find((each) => each.pixel === null);
    return next?.key ?? null;
  }

  /** Returns the marker nearest to a place in a camera's picture, no farther than `within` px; null: none. */
  nearest(camera: string, [u, v]: Vector2, within: number): MarkerKey | null {
    let best: MarkerKey | null = null;
    let least = within;
    for (const marker of this.of(camera)) {
      if (marker.pixel === null) continue;
      const distance = Math.hypot(marker.pixel[0] - u, marker.pixel[1] - v);
      if (distance <= least) {
        least = distance;
        best = marker.key;
      }
    }
    return best;
  }

  private shown(marker: MarkerState): ShownMarker {
    const key = keyOf(marker);
    const pixel = this.moved.get(key);
    return pixel === undefined ? { ...marker, key, moving: false } : { ...marker, key, pixel, moving: true, residual_px: null };
  }
}
