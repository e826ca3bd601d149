/** Where on the page a step wants one to look: a ring about it, and a line from the card to the ring. */

import { Vector3 } from "three";
import { RINGS } from "../maths/centreline";
import type { Stage } from "../stage/stage";
import type { Anchor } from "./steps";

/** Of the ring about a place of the scene, CSS pixels. */
const SCENE_RING_PX = 34;
const ELEMENT_ROOM_PX = 4;
/** Elements move when the page is laid out anew: seldom. */
const LOOK_EVERY_MS = 120;

export interface Place {
  x: number;
  y: number;
  w: number;
  h: number;
  round: boolean;
  /** Whether there is something to be seen. */
  shown: boolean;
}

/** Of the drawn line, its middle ring. */
const MIDDLE = 3 * Math.floor(RINGS / 2);

const point = new Vector3();

/** Finds an anchor on the page again and again. */
export class AnchorFinder {
  readonly place: Place = { x: 0, y: 0, w: 0, h: 0, round: false, shown: false };
  private anchor: Anchor | null = null;
  private lookedMs = -Infinity;

  constructor(private readonly stage: Stage) {}

  /** Turns to another anchor, and brings it into view. */
  aim(anchor: Anchor | null): void {
    this.anchor = anchor;
    this.lookedMs = -Infinity;
    this.place.shown = false;
    if (anchor === null || !("element" in anchor)) return;
    this.find(anchor.element)?.scrollIntoView({ block: "nearest", behavior: "auto" });
  }

  /** Returns where the anchor is now. */
  update(nowMs: number): Place {
    const { anchor, place } = this;
    if (anchor === null) place.shown = false;
    else if ("element" in anchor) this.updateElement(anchor.element, nowMs);
    else if ("scene" in anchor) this.updateScene(anchor.scene);
    else place.shown = false;
    return place;
  }

  private updateElement(selector: string, nowMs: number): void {
    if (nowMs - this.lookedMs < LOOK_EVERY_MS) return;
    this.lookedMs = nowMs;
    const element = this.find(selector);
    const { place } = this;
    if (element === null) {
      place.shown = false;
      return;
    }
    const box = element.getBoundingClientRect();
    place.x = box.x - ELEMENT_ROOM_PX;
    place.y = box.y - ELEMENT_ROOM_PX;
    place.w = box.width + 2 * ELEMENT_ROOM_PX;
    place.h = box.height + 2 * ELEMENT_ROOM_PX;
    place.round = false;
    place.shown = box.width > 0 && box.height > 0 && box.bottom > 0 && box.top < innerHeight;
  }

  /** Finds the element, or what brings it into view on a small screen: its panel's tab. */
  private find(selector: string): HTMLElement | null {
    const wanted = document.querySelector<HTMLElement>(selector);
    const whole = wanted?.closest<HTMLElement>(".slider") ?? wanted;
    if (whole === null || whole.getClientRects().length > 0) return whole;
    const tab = whole.closest<HTMLElement>(".panel")?.dataset["tab"];
    const button = tab === undefined ? null : document.querySelector<HTMLElement>(`.tabs [data-show="${tab}"]`);
    return button !== null && button.getClientRects().length > 0 ? button : null;
  }

  private updateScene(what: "catheter" | "inlet" | "tip" | "heart" | "target"): void {
    const { place } = this;
    const { view, tip, catheter } = this.stage;
    place.shown = false;
    if (what === "heart" || this.stage.store.value.mode !== "3d") return; // it is the whole picture
    if (!scenePoint(point, this.stage, what) || (what !== "target" && what !== "inlet" && (!tip.valid || !catheter.shown))) return;
    point.project(view.camera);
    if (Math.abs(point.x) > 1 || Math.abs(point.y) > 1 || point.z > 1) return;
    const box = view.renderer.domElement.getBoundingClientRect();
    place.x = box.x + ((point.x + 1) / 2) * box.width - SCENE_RING_PX;
    place.y = box.y + ((1 - point.y) / 2) * box.height - SCENE_RING_PX;
    place.w = place.h = 2 * SCENE_RING_PX;
    place.round = place.shown = true;
  }
}

/** Writes where something of the scene is, m in the room; returns whether it is anywhere. */
export function scenePoint(out: Vector3, stage: Stage, what: "catheter" | "inlet" | "tip" | "heart" | "target"): boolean {
  const { view, tip, catheter, targets } = stage;
  if (what === "target") {
    if (targets.active === null) return false;
    out.copy(targets.active.position);
  } else if (what === "catheter") {
    const { position } = catheter.line;
    if (!catheter.shown) return false;
    out.set(position[MIDDLE]!, position[MIDDLE + 1]!, position[MIDDLE + 2]!);
  } else if (what === "inlet") {
    out.set(0, 0, 0);
  } else if (what === "tip") {
    if (!tip.valid) return false;
    out.setFromMatrixPosition(tip.matrix);
  } else {
    return false; // the whole picture, or what a headset's wearer holds: they know better where it is
  }
  view.box.updateWorldMatrix(true, false);
  out.applyMatrix4(view.box.matrixWorld);
  return true;
}
