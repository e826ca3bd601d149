/** Pointers and wheel on a slice: looking, placing seeds, window, zoom, moving; with a mouse, a pen or fingers. */

import type { Vector2, Vector3 } from "../generated/messages";
import type { SeedsModel, Tool } from "./model";
import { dragged } from "./paint";
import type { SliceView } from "./slice_view";

/** A press that moves farther than this is a drag, CSS pixels. */
const STILL = 5;
/** Wheels and touch pads count differently: this much is one slice. */
const NOTCH_PX = 60;

export interface SliceInputHandlers {
  /** A click at seen coordinates while a structure is chosen. */
  onClick(seen: Vector3, add: boolean): void;
  /** The pointer is over seen coordinates; null: over none. */
  onHover(view: SliceView, seen: Vector3 | null): void;
  /** This view was used last: keys go to it. */
  onFocus(view: SliceView): void;
}

interface Press {
  readonly tool: Tool;
  last: Vector2;
  moved: boolean;
}

export class SliceInput {
  private readonly fingers = new Map<number, Vector2>();
  private press: Press | null = null;
  private wheeled = 0;

  constructor(private readonly view: SliceView, private readonly model: SeedsModel, private readonly handlers: SliceInputHandlers) {
    const { canvas } = view;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => this.cancel(event));
    canvas.addEventListener("pointerleave", () => this.handlers.onHover(this.view, null));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("focus", () => this.handlers.onFocus(this.view));
  }

  private at(event: PointerEvent | WheelEvent): Vector2 {
    const box = this.view.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  private down(event: PointerEvent): void {
    this.handlers.onFocus(this.view);
    this.view.canvas.setPointerCapture(event.pointerId);
    if (event.button === 1) event.preventDefault(); // no scrolling by itself
    const at = this.at(event);
    this.fingers.set(event.pointerId, at);
    if (this.fingers.size > 1) {
      this.press = null; // two fingers zoom and move, and place nothing
      return;
    }
    const tool = event.button === 1 ? "move" : event.button === 2 ? "window" : this.model.tool;
    this.press = { tool, last: at, moved: false };
  }

  private move(event: PointerEvent): void {
    const at = this.at(event);
    const before = this.fingers.get(event.pointerId);
    if (before === undefined) {
      this.handlers.onHover(this.view, this.view.seenAt(at));
      return;
    }
    if (this.fingers.size > 1) {
      this.pinch(event.pointerId, before, at);
      this.fingers.set(event.pointerId, at);
      return;
    }
    this.fingers.set(event.pointerId, at);
    const { press } = this;
    if (press === null) return;
    const step: Vector2 = [at[0] - press.last[0], at[1] - press.last[1]];
    if (!press.moved && Math.hypot(...step) < STILL) return;
    press.moved = true;
    press.last = at;
    if (press.tool === "move") this.view.panBy(step);
    else if (press.tool === "window") this.model.window = dragged(this.model.window, step);
    else this.look(at);
  }

  private up(event: PointerEvent): void {
    const { press } = this;
    const alone = this.fingers.size === 1;
    this.cancel(event);
    if (press === null || press.moved || !alone || press.tool !== "point") return;
    const at = this.at(event);
    const seen = this.view.seenAt(at);
    this.look(at);
    if (seen !== null && this.model.chosen !== null) this.handlers.onClick(seen, event.shiftKey || this.model.adding);
  }

  private cancel(event: PointerEvent): void {
    this.fingers.delete(event.pointerId);
    if (this.fingers.size === 0) this.press = null;
  }

  private look(at: Vector2): void {
    const seen = this.view.seenAt(at);
    if (seen !== null) this.model.look(seen);
  }

  private pinch(id: number, before: Vector2, now: Vector2): void {
    const other = [...this.fingers].find(([each]) => each !== id)?.[1];
    if (other === undefined) return;
    const apart = (from: Vector2): number => Math.max(8, Math.hypot(from[0] - other[0], from[1] - other[1]));
    this.view.panBy([(now[0] - before[0]) / 2, (now[1] - before[1]) / 2]);
    this.view.zoomBy(apart(now) / apart(before), [(now[0] + other[0]) / 2, (now[1] + other[1]) / 2]);
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    this.handlers.onFocus(this.view);
    const pixels = event.deltaY * (event.deltaMode === 1 ? 20 : 1);
    if (event.ctrlKey || event.metaKey) { // a pinch on a touch pad comes as this too
      this.view.zoomBy(Math.exp(-pixels * 0.0025), this.at(event));
      return;
    }
    if (Math.sign(pixels) !== Math.sign(this.wheeled)) this.wheeled = 0;
    this.wheeled += pixels;
    const notches = Math.trunc(this.wheeled / NOTCH_PX);
    if (notches === 0) return;
    this.wheeled -= notches * NOTCH_PX;
    this.view.goTo(this.model.slice(this.view.name) + Math.sign(notches) * Math.min(10, Math.abs(notches)));
  }
}
