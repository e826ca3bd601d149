/** The desktop's flat pictures: plates laid over the canvas in CSS pixels, where the page's frames are. */

import { Color, OrthographicCamera, Scene } from "three";
import type { Object3D, WebGLRenderer } from "three";
import type { Overlay } from "../scene/view";
import type { Plate } from "./plate";

/** A place for a plate: an element over the canvas. */
export interface Slot {
  readonly element: HTMLElement;
  plate: Plate | null;
}

export class Desk implements Overlay {
  /** Instead of the 3D picture. */
  alone = false;
  readonly scene = new Scene();
  private readonly camera = new OrthographicCamera(0, 1, 1, 0, -100, 100);
  private readonly background = new Color(0x05080c);
  private dirty = true;
  private shown = false;

  /** host: what the canvas fills. onLayout: asks for a new picture. */
  constructor(private readonly host: HTMLElement, readonly slots: readonly Slot[], onLayout: () => void) {
    const observer = new ResizeObserver(() => {
      this.dirty = true;
      onLayout();
    });
    observer.observe(host);
    for (const { element } of slots) observer.observe(element);
  }

  /** Puts a plate into a slot, or takes out what is there. */
  put(slot: Slot, plate: Plate | null): void {
    if (slot.plate === plate && (plate === null || plate.group.parent === this.scene)) return;
    if (slot.plate !== null && slot.plate.group.parent === this.scene && this.slots.every((other) => other === slot || other.plate !== slot.plate)) {
      slot.plate.group.removeFromParent();
    }
    slot.plate = plate;
    if (plate !== null) this.scene.add(plate.group);
    this.dirty = true;
  }

  /** Lays the plates out again when the page has changed; returns the width (CSS pixels) by slot through `onSize`. */
  layOut(onSize: (slot: Slot, widthPx: number) => void): boolean {
    if (!this.dirty) return false;
    this.dirty = false;
    const outer = this.host.getBoundingClientRect();
    this.camera.right = Math.max(1, outer.width);
    this.camera.top = Math.max(1, outer.height);
    this.camera.updateProjectionMatrix();
    this.shown = false;
    for (const slot of this.slots) {
      const { plate } = slot;
      if (plate === null || plate.group.parent !== this.scene) continue;
      const inner = slot.element.getBoundingClientRect();
      const scale = Math.min(inner.width / plate.widthM, inner.height / plate.heightM);
      plate.group.visible = scale > 1;
      if (scale <= 1) continue;
      this.shown = true;
      stand(plate.group, inner.left - outer.left + inner.width / 2, outer.bottom - inner.bottom + inner.height / 2, scale);
      onSize(slot, scale * plate.widthM);
    }
    return true;
  }

  /** Returns where a pointer is on a slot's plate, u from the left and v from below; 0 to 1 where it is within. */
  placeOf(slot: Slot, event: PointerEvent, out: { u: number; v: number }): void {
    const { plate } = slot;
    if (plate === null) return;
    const inner = slot.element.getBoundingClientRect();
    const scale = Math.min(inner.width / plate.widthM, inner.height / plate.heightM);
    out.u = 0.5 + (event.clientX - inner.left - inner.width / 2) / (scale * plate.widthM);
    out.v = 0.5 - (event.clientY - inner.top - inner.height / 2) / (scale * plate.heightM);
  }

  render(renderer: WebGLRenderer): void {
    if (!this.alone && !this.shown) return;
    const { info } = renderer;
    const clears = renderer.autoClear;
    const resets = info.autoReset;
    info.autoReset = this.alone && resets;
    renderer.autoClear = this.alone;
    this.scene.background = this.alone ? this.background : null;
    if (!this.alone) renderer.clearDepth();
    renderer.render(this.scene, this.camera);
    renderer.autoClear = clears;
    info.autoReset = resets;
  }
}

function stand(group: Object3D, x: number, y: number, scale: number): void {
  group.position.set(x, y, 0);
  group.quaternion.identity();
  group.scale.setScalar(scale);
}
