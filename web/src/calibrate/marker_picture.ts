/** One camera's picture while markers are placed: pointing, placing, dragging, zooming. */

import type { Vector2 } from "../generated/messages";
import { make, setText } from "../ui/dom";
import { clamped, isInside, panned, toCanvas, toPicture, WHOLE, zoomed } from "./fit";
import { LivePicture } from "./live_picture";
import type { MarkerKey, MarkerModel } from "./marker_model";
import type { Pointing } from "./marker_overlay";
import { drawMarkers } from "./marker_overlay";

/** How near the pointer takes hold of a marker, CSS pixels. */
const REACH = 16;
const FINGER_REACH = 26;
/** A press that moves farther than this is a drag. */
const STILL = 4;
const FINE = 1 / 8;
export const ZOOM_STEP = 1.6;

export interface MarkerPictureHandlers {
  /** A marker was taken hold of; null: none. */
  onSelect(key: MarkerKey | null): void;
  /** It is being moved. */
  onMove(key: MarkerKey, pixel: Vector2): void;
  /** It was let go at a place. `exact`: this very place is meant. */
  onPlace(key: MarkerKey, pixel: Vector2, exact: boolean): void;
}

/** What a press does until it ends. */
type Press =
  | { readonly kind: "move"; readonly key: MarkerKey; pixel: Vector2; last: Vector2; moved: boolean; fine: boolean; readonly placing: boolean }
  | { readonly kind: "pan"; last: Vector2; moved: boolean };

export class MarkerPicture {
  readonly element = make("figure", "shot marked");
  readonly live: LivePicture;
  private readonly canvas = make("canvas");
  private readonly caption = make("span");
  private pointing: Pointing | null = null;
  private press: Press | null = null;
  private operating = false;

  constructor(
    readonly camera: string, picturesHz: number, private readonly model: MarkerModel, private readonly handlers: MarkerPictureHandlers,
  ) {
    const note = make("span", "note");
    this.canvas.tabIndex = 0;
    this.canvas.dataset["camera"] = camera;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", `Picture of the ${camera} camera: choose a marker, then click its centre here`);
    const foot = make("figcaption");
    foot.append(this.caption, this.zoomButtons());
    this.element.append(this.canvas, note, foot);
    this.live = new LivePicture({
      camera, canvas: this.canvas, note, picturesHz, full: true,
      overlay: (on) => drawMarkers(on, model.of(camera), model.selected, this.pointing),
    });
    this.live.still = true;
    this.canvas.addEventListener("pointerdown", (event) => this.down(event));
    this.canvas.addEventListener("pointermove", (event) => this.move(event));
    this.canvas.addEventListener("pointerup", (event) => this.up(event));
    this.canvas.addEventListener("pointercancel", () => this.cancel());
    this.canvas.addEventListener("pointerleave", () => this.point(null));
    this.canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    this.canvas.addEventListener("dblclick", () => {
      if (this.model.selected === null) this.whole();
    });
  }

  setOperating(operating: boolean): void {
    if (this.operating && !operating) this.cancel();
    this.operating = operating;
  }

  refresh(): void {
    const markers = this.model.of(this.camera);
    const there = markers.filter((marker) => marker.pixel !== null).length;
    const zoom = this.live.zoom.factor > 1.01 ? `, ${this.live.zoom.factor.toFixed(1)} times` : "";
    setText(this.caption, `${capital(this.camera)} camera: ${there} of ${markers.length} fiducials${zoom}`);
    const chosen = this.chosen();
    this.canvas.dataset["placing"] = String(this.operating && chosen !== null && chosen.pixel === null);
    this.canvas.dataset["held"] = String((this.operating && chosen !== null) || this.live.zoom.factor > 1);
    this.live.describe(this.model.size(this.camera));
    this.live.redraw();
  }

  /** Shows the whole picture. */
  whole(): void {
    this.live.zoom = WHOLE;
    this.refresh();
  }

  zoomBy(factor: number): void {
    const { canvasSize, picture, fit } = this.live;
    const chosen = this.chosen();
    const middle: Vector2 = [canvasSize.width / 2, canvasSize.height / 2];
    const at = chosen?.pixel ? toCanvas(fit, chosen.pixel) : middle;
    this.live.zoom = zoomed(this.live.zoom, factor, at, picture, canvasSize);
    this.refresh();
  }

  /** Gives the press up: the marker stays where the server has it. */
  cancel(): void {
    if (this.press?.kind === "move") this.model.release(this.press.key);
    this.press = null;
    this.point(null);
    this.refresh();
  }

  private zoomButtons(): HTMLElement {
    const group = make("div", "zooms");
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", `Zoom of the ${this.camera} picture`);
    for (const [words, label, act] of [
      ["+", "Enlarge", () => this.zoomBy(ZOOM_STEP)],
      ["−", "Make smaller", () => this.zoomBy(1 / ZOOM_STEP)],
      ["Whole", "Whole picture", () => this.whole()],
    ] as const) {
      const button = make("button", "", words);
      button.type = "button";
      button.title = label;
      button.setAttribute("aria-label", label);
      button.addEventListener("click", act);
      group.append(button);
    }
    return group;
  }

  private chosen(): ReturnType<MarkerModel["find"]> {
    const marker = this.model.selected === null ? null : this.model.find(this.model.selected);
    return marker?.camera === this.camera ? marker : null;
  }

  private at(event: PointerEvent | WheelEvent): Vector2 {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  private down(event: PointerEvent): void {
    if (event.button !== 0 || this.press !== null) return;
    this.canvas.setPointerCapture(event.pointerId);
    const at = this.at(event);
    const { fit, picture } = this.live;
    const pixel = toPicture(fit, at);
    const chosen = this.chosen();
    const reach = (event.pointerType === "touch" ? FINGER_REACH : REACH) / fit.scale;
    const near = this.model.nearest(this.camera, pixel, reach);
    if (this.operating && chosen !== null && chosen.pixel === null && isInside(pixel, picture)) {
      this.press = { kind: "move", key: chosen.key, pixel, last: at, moved: true, fine: false, placing: true };
      this.lead(pixel, at, event);
    } else if (near !== null) {
      this.handlers.onSelect(near);
      if (!this.operating) return;
      this.press = { kind: "move", key: near, pixel: this.model.find(near)!.pixel!, last: at, moved: false, fine: false, placing: false };
    } else {
      this.press = { kind: "pan", last: at, moved: false };
    }
  }

  private move(event: PointerEvent): void {
    const at = this.at(event);
    const { press } = this;
    if (press === null) {
      this.hover(at, event);
      return;
    }
    const step: Vector2 = [at[0] - press.last[0], at[1] - press.last[1]];
    if (!press.moved && Math.hypot(...step) < STILL) return;
    press.moved = true;
    press.last = at;
    if (press.kind === "pan") {
      this.live.zoom = panned(this.live.zoom, step, this.live.picture, this.live.canvasSize);
      this.live.redraw();
      return;
    }
    const slow = event.shiftKey ? FINE : 1;
    press.fine ||= event.shiftKey;
    const { fit, picture } = this.live;
    press.pixel = press.placing && !press.fine
      ? clamped(toPicture(fit, at), picture)
      : clamped([press.pixel[0] + (slow * step[0]) / fit.scale, press.pixel[1] + (slow * step[1]) / fit.scale], picture);
    this.lead(press.pixel, at, event);
  }

  private up(event: PointerEvent): void {
    const { press } = this;
    this.press = null;
    if (event.pointerType === "touch") this.point(null);
    if (press?.kind === "move" && press.moved) this.handlers.onPlace(press.key, press.pixel, press.fine);
    if (press?.kind === "pan" && !press.moved) this.handlers.onSelect(null);
    if (press !== null) this.hover(this.at(event), event);
  }

  /** Shows the marker at the place that is meant, with the loupe beside the pointer. */
  private lead(pixel: Vector2, at: Vector2, event: PointerEvent): void {
    const { key } = this.press as Extract<Press, { kind: "move" }>;
    this.handlers.onMove(key, pixel);
    this.point({ at, pixel, colour: this.model.find(key)?.colour ?? "", finger: event.pointerType === "touch" });
  }

  /** Follows the pointer with the loupe while a marker waits to be placed. */
  private hover(at: Vector2, event: PointerEvent): void {
    const chosen = this.chosen();
    const pixel = toPicture(this.live.fit, at);
    const wanted = this.operating && event.pointerType !== "touch" && chosen !== null && chosen.pixel === null;
    this.point(wanted && isInside(pixel, this.live.picture) ? { at, pixel, colour: chosen.colour, finger: false } : null);
  }

  private point(pointing: Pointing | null): void {
    if (this.pointing === null && pointing === null) return;
    this.pointing = pointing;
    this.live.redraw();
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : 1;
    const factor = Math.exp(-event.deltaY * lines * 0.0015);
    this.live.zoom = zoomed(this.live.zoom, factor, this.at(event), this.live.picture, this.live.canvasSize);
    this.refresh();
  }
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
