/** The flat pictures: beside the 3D view, or instead of it as a cath lab shows them; on the page and in a headset. */

import { Matrix4, Vector3 } from "three";
import type { BufferAttribute } from "three";
import { paired } from "../fluoro/arms";
import { FluoroPlate } from "../fluoro/fluoro_plate";
import { XrayField } from "../fluoro/xray";
import type { SceneDescription } from "../generated/messages";
import type { IceMode } from "../ice/ice_mode";
import type { HeartVolumes } from "../ice/volumes";
import type { TipView } from "../scene/endoscope";
import { ctFromBox } from "../maths/registration";
import type { Feature, Frame } from "../stage/feature";
import type { SceneSettings } from "../stage/settings";
import type { Stage } from "../stage/stage";
import { Desk } from "./desk";
import type { Slot } from "./desk";
import { EndoscopePlate } from "./endoscope_plate";
import { Frames, setArm } from "./frames";
import type { Plate } from "./plate";
import { Wall } from "./wall";

/** A headset knows where its wearer looks only after a few frames. */
const HEAD_FRAMES = 4;
/** Sizes at which text is as it was drawn: smaller pictures get larger letters. */
const TEXT_PX = { panel: 600, fluoro: 430, most: 2.1 } as const;

export class FlatView implements Feature {
  readonly arms: readonly [FluoroPlate, FluoroPlate];
  readonly desk: Desk;
  private readonly field = new XrayField();
  private readonly frames: Frames;
  private readonly wall = new Wall();
  private readonly tipView: EndoscopePlate | null;
  private readonly boxMiddle = new Vector3();
  private readonly ctFromBox = new Matrix4();
  private readonly position: BufferAttribute;
  private applied: SceneSettings | null = null;
  private volume = -1;
  /** Without a heart nothing is seen from the tip. */
  private hasHeart = true;
  private immersive = false;
  private waiting = 0;
  private drawn = -1;
  private wasShown = false;
  private lock: unknown = null;

  /** Throws Error when the browser gives no 2D canvas. */
  constructor(
    private readonly stage: Stage, private readonly ice: IceMode, private readonly volumes: HeartVolumes, private readonly view: TipView | null,
  ) {
    const { view: { renderer }, catheter, store } = stage;
    this.arms = [
      new FluoroPlate("A", renderer, this.field, catheter.geometry), new FluoroPlate("B", renderer, this.field, catheter.geometry),
    ];
    this.arms.forEach((plate, arm) => (plate.onTurn = (angles) => setArm(store, arm as 0 | 1, angles)));
    this.position = catheter.geometry.getAttribute("position") as BufferAttribute;
    this.tipView = view === null ? null : new EndoscopePlate(view);
    const host = renderer.domElement.parentElement!;
    this.frames = new Frames(host, store);
    this.desk = new Desk(host, this.frames.slots, () => stage.view.touch());
    stage.view.overlay = this.desk;
    renderer.domElement.addEventListener("webglcontextrestored", () => this.arms.forEach(({ image }) => image.turn()));
    for (const slot of this.frames.slots) this.takePointer(slot);
    const pair = (now: SceneSettings, before: SceneSettings): void => {
      const change = paired(now, before);
      if (change !== null) store.set(change);
    };
    store.listen(pair);
    pair(store.value, store.value);
  }

  describe(scene: SceneDescription): void {
    const [low, high] = [scene.roi_min_mm, scene.roi_max_mm];
    this.boxMiddle.set((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2);
    if (scene.heart !== null) ctFromBox(this.ctFromBox, scene.heart.registration);
    if (this.hasHeart !== (scene.heart !== null)) {
      this.hasHeart = scene.heart !== null;
      this.applied = null;
    }
    for (const arm of this.arms) arm.radiusMm = scene.catheter_diameter_mm / 2;
    this.takeVolume();
  }

  update(frame: Frame): boolean {
    const { store } = this.stage;
    let changed = this.volume !== this.volumes.version && this.takeVolume();
    if (frame.immersive !== this.immersive) {
      this.immersive = frame.immersive;
      this.waiting = frame.immersive ? HEAD_FRAMES : 0;
      this.applied = null;
    }
    if (this.waiting > 0) this.waiting -= 1;
    else if (store.value !== this.applied || store.lock !== this.lock) changed = this.arrange(store.value) || changed;
    changed = this.desk.layOut(this.onSize) || changed;
    this.tipView?.refresh();
    return (store.value.mode === "2d" && this.updateArms(frame)) || changed;
  }

  dispose(): void {
    for (const arm of this.arms) arm.dispose();
    this.tipView?.dispose();
    this.field.dispose();
    this.stage.view.overlay = null;
  }

  private updateArms(frame: Frame): boolean {
    const shown = this.stage.catheter.shown && frame.track !== null;
    const moved = this.position.version !== this.drawn || shown !== this.wasShown;
    this.drawn = this.position.version;
    this.wasShown = shown;
    const changed = this.arms[0].update(frame.nowMs, frame.track, shown, moved, this.volumes.trouble);
    return this.arms[1].update(frame.nowMs, frame.track, shown, moved, this.volumes.trouble) || changed;
  }

  private takeVolume(): boolean {
    this.volume = this.volumes.version;
    this.field.take(this.volumes.acoustic, this.boxMiddle.clone().applyMatrix4(this.ctFromBox));
    for (const arm of this.arms) arm.place(this.ctFromBox);
    return true;
  }

  /** Puts every picture where it belongs by mode, ICE, and whether a headset is worn. */
  private arrange(now: SceneSettings): boolean {
    const before = this.applied;
    this.applied = now;
    this.lock = this.stage.store.lock;
    this.arms.forEach((plate, arm) => plate.fit(now.arms[arm]!));
    this.frames.refresh();
    if (before !== null && before.mode === now.mode && before.ice === now.ice) return true;
    const third = now.ice ? this.ice.plate : this.hasHeart ? this.tipView : null;
    const flat = now.mode === "2d";
    this.stage.world.visible = !flat;
    if (this.view !== null) this.view.wanted = !now.ice && this.hasHeart;
    this.clear();
    this.stage.plates.length = 0;
    if (this.immersive) this.hang(flat, third);
    else this.lay(flat, third);
    return true;
  }

  /** On the page. */
  private lay(flat: boolean, third: Plate | null): void {
    const { frames, desk } = this;
    this.frames.show(flat ? "2d" : "3d", third);
    for (const arm of this.arms) arm.buttons = false;
    desk.alone = flat;
    desk.put(frames.inset, flat ? null : third);
    desk.put(frames.arms[0], flat ? this.arms[0] : null);
    desk.put(frames.arms[1], flat ? this.arms[1] : null);
    desk.put(frames.third, flat ? third : null);
  }

  /** In the headset's room. */
  private hang(flat: boolean, third: Plate | null): void {
    const { scene, head } = this.stage.view;
    const plates: readonly Plate[] = third === null ? this.arms : [...this.arms, third];
    this.frames.show("none", null);
    for (const arm of this.arms) {
      arm.textScale = this.wall.textScale;
      arm.buttons = true;
    }
    this.ice.panel.textScale = this.wall.textScale;
    if (flat) {
      this.wall.hang(plates, scene, head);
      this.stage.plates.push(this.wall);
    } else if (third !== null) {
      this.wall.beside(third, scene, head);
      this.stage.plates.push(third);
    }
  }

  private clear(): void {
    this.wall.clear();
    for (const slot of this.frames.slots) this.desk.put(slot, null);
    for (const plate of [...this.arms, this.ice.plate, this.tipView]) plate?.group.removeFromParent();
  }

  private readonly onSize = (slot: Slot, widthPx: number): void => {
    const { plate } = slot;
    if (plate === this.ice.plate) this.ice.panel.textScale = scaled(TEXT_PX.panel, widthPx);
    for (const arm of this.arms) if (plate === arm) arm.textScale = scaled(TEXT_PX.fluoro, widthPx);
  };

  /** Gives what a mouse or finger does on a frame to its plate. */
  private takePointer(slot: Slot): void {
    const at = { u: 0, v: 0 };
    const { element } = slot;
    const give = (event: PointerEvent, phase: "press" | "drag" | "release"): void => {
      if (slot.plate?.pointer === undefined || this.stage.store.locked("arms")) return;
      this.desk.placeOf(slot, event, at);
      slot.plate.pointer(at.u, at.v, phase);
    };
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      give(event, "press");
    });
    element.addEventListener("pointermove", (event) => {
      if (element.hasPointerCapture(event.pointerId)) give(event, "drag");
    });
    for (const name of ["pointerup", "pointercancel"] as const) element.addEventListener(name, (event) => give(event, "release"));
  }
}

function scaled(fullPx: number, widthPx: number): number {
  return Math.round(20 * Math.min(TEXT_PX.most, Math.max(1, fullPx / widthPx))) / 20;
}
