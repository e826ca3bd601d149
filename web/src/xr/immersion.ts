/** The headset: its sessions, the viewer's hands, where the world stands, the menu, the numbers and what must not be missed. */

import { Color, Vector3 } from "three";
import type { Scene } from "three";
import type { SceneDescription } from "../generated/messages";
import type { Plate } from "../flat/plate";
import type { DrawnTrack } from "../motion/drawn";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import type { Condition } from "../ui/condition";
import type { CanvasPlate } from "./canvas_plate";
import { HandDrawings } from "./drawings";
import { drawBefore, lengthOf } from "./drawn";
import { Clearing } from "./clearing";
import { HandCut } from "./hand_cut";
import { HeartBatch } from "./heart_batch";
import { isShown } from "./hits";
import { CONTROLLER_HELP, HAND_HELP } from "./help_words";
import type { LazyFollower } from "./hud";
import { Hud, Notice } from "./hud";
import { hudLines, noticeOf } from "./hud_words";
import { Interaction } from "./interaction";
import { LabelBatch } from "./label_batch";
import { Menu } from "./menu";
import { MenuActs } from "./menu_acts";
import type { Head, Placement } from "./placement";
import { Places } from "./places";
import type { PressKind } from "./pointer";
import { Pointer } from "./pointer";
import type { XrReport } from "./report";
import { XrSessions } from "./sessions";
import { WristButton } from "./wrist";

const SAY_EVERY_MS = 200;
/** Of the heart with its vessels, at true scale. */
const HEART_RADIUS_M = 0.075;
/** Kept in sight about the tip, at true scale. */
const TIP_RADIUS_M = 0.004;
/** So much enlarged, the heart is around its viewer: the box is out of place. */
const NEARLY_INSIDE = 4;

/** The first frames may come before the headset knows where it is. */
const SETTLED_FRAMES = 3;
/** xr-standard mapping. */
const BUTTON = { stick: 3, lower: 4, upper: 5 } as const;
const BUTTONS: readonly number[] = Object.values(BUTTON);

/** A plate that stays in view, beside the numbers. */
export interface HeadUp extends CanvasPlate {
  readonly follower: LazyFollower;
}

export class Immersion implements Feature {
  readonly sessions: XrSessions;
  readonly places: Places;
  readonly menu: Menu;
  readonly notice = new Notice();
  readonly acts: MenuActs;
  /** Other plates that stay in view; they show and hide themselves. */
  readonly headUps: HeadUp[] = [];
  private readonly head: Head;
  private readonly hud = new Hud();
  private readonly wrist: WristButton;
  readonly pointers: readonly [Pointer, Pointer];
  private readonly hands: HandDrawings;
  private readonly heart: HeartBatch;
  private readonly labels: LabelBatch;
  private readonly interaction: Interaction;
  private readonly cut: HandCut;
  private readonly own: readonly Plate[];
  private readonly pointable: Plate[] = [];
  /** Which buttons were down at the last frame, a bit for each, by hand. */
  private readonly down = [0, 0];
  private condition: Condition | null = null;
  private framesIn = -1;
  private saidMs = -Infinity;
  private bare = false;
  private readonly place = new Vector3();
  private readonly clearing = new Clearing();
  private boxShown = true;

  constructor(private readonly stage: Stage) {
    const { view, settings } = stage;
    const low = settings.material === "lambert";
    this.sessions = new XrSessions(view, { scale: settings.pixelRatio ?? 1, foveation: low ? 1 : 0.6 });
    this.head = view.head;
    this.places = new Places(stage, view.camera);
    this.acts = new MenuActs(stage, (placement) => this.go(placement), () => this.sessions.leave());
    this.menu = new Menu({
      store: stage.store,
      parts: () => this.acts.parts,
      helpLines: () => (this.bare ? HAND_HELP : CONTROLLER_HELP),
      canGuide: () => this.acts.guide !== null,
      target: () => this.acts.target,
      tip: () => stage.tip.valid,
      roll: () => this.acts.roll?.view ?? null,
      training: () => this.acts.training?.rows() ?? [],
      onAct: (act) => this.acts.act(act),
    });
    this.wrist = new WristButton(() => this.menu.toggle(this.head));
    this.own = [this.menu, this.wrist];
    const { xr } = view.renderer;
    const handlers = {
      onPress: (pointer: Pointer, kind: PressKind) => this.interaction.press(pointer, kind),
      onRelease: (pointer: Pointer, kind: PressKind) => this.interaction.release(pointer, kind),
      onLost: (pointer: Pointer) => this.interaction.lose(pointer),
    };
    this.pointers = [new Pointer(xr, 0, handlers), new Pointer(xr, 1, handlers)];
    this.interaction = new Interaction(this.pointers, this.places.grab, () => this.pointable, () => undefined);
    this.hands = new HandDrawings(this.pointers, view.scene);
    this.heart = new HeartBatch(stage.heart, view.box);
    this.labels = new LabelBatch(view.scene, view.box);
    this.cut = new HandCut(stage.cuts, view.box, this.interaction);
    view.scene.add(this.menu.group, this.wrist.group, this.hud.group, this.notice.group);
    view.onBeforePicture = () => this.gather();
    stage.targets.listen(() => this.menu.refresh());
    this.watch();
  }

  describe(scene: SceneDescription): void {
    this.acts.parts = (scene.heart?.parts ?? []).map((part) => ({ name: part.name, label: part.label }));
    this.menu.refresh();
    this.boxShown = true;
    if (this.framesIn >= 0) this.framesIn = 0; // another heart: before the viewer, as at the beginning
    this.showFloor();
  }

  /** Takes the page's one thing to tell: its status, and what is wrong with the link. */
  tell(condition: Condition): void {
    this.condition = condition;
  }

  update(frame: Frame): boolean {
    if (!this.stage.view.immersive) return false;
    const { head } = this;
    this.arrive(frame.nowMs);
    this.listPlates();
    for (const pointer of this.pointers) pointer.update(frame.dtS);
    this.buttons();
    this.interaction.update(frame.nowMs, frame.dtS, head);
    this.places.update(frame.nowMs);
    this.stage.view.scaleLabels(this.places.scale);
    this.cut.update(this.pointers, this.stage.store.value.cut === "hand");
    this.wrist.update(this.pointers, head);
    this.menu.update(frame.nowMs);
    this.say(frame);
    this.hands.update(this.interaction);
    return true;
  }

  /** Comes after all that stands in the scene is as it should be: draws it in fewer calls. */
  private gather(): void {
    if (!this.stage.view.immersive) return;
    const around = this.places.scale >= NEARLY_INSIDE;
    this.showBox(!around);
    const within = around && this.isWithin();
    this.heart.update(within);
    this.showBefore(within);
    this.labels.update(this.stage.view.labelsVersion);
  }

  /** Whether the viewer's head is in the blood of the heart. */
  private isWithin(): boolean {
    const { blood, view } = this.stage;
    return blood !== null && blood.chamberAt(view.box.worldToLocal(this.place.copy(this.head.position))) !== 0;
  }

  private showBox(visible: boolean): void {
    if (visible === this.boxShown) return;
    this.boxShown = visible;
    const roi = this.stage.view.box.getObjectByName("roi");
    if (roi !== undefined) roi.visible = visible;
  }

  /** In a chamber of the heart, walls stand between the viewer and plates: these are drawn over them then. */
  private showBefore(within: boolean): void {
    drawBefore(this.hud.group, within);
    for (const plate of this.headUps) drawBefore(plate.group, within);
    for (const plate of this.own) drawBefore(plate.group, within);
    for (const plate of this.stage.plates) drawBefore(plate.group, within);
    drawBefore(this.hands.marks.mesh, within);
  }

  /** Puts the world somewhere before or around the viewer. */
  go(placement: Placement): void {
    this.places.go(placement, this.head, performance.now());
  }

  /** What is behind everything, as a colour; null: the room. */
  get background(): string | null {
    const { background } = this.stage.view.scene;
    return background instanceof Color ? `#${background.getHexString()}` : null;
  }

  get scene(): Scene {
    return this.stage.view.scene;
  }

  /** Takes a point of `box`, mm, to where it is drawn in the room, m; in place. */
  roomFromBox(point: Vector3): Vector3 {
    const { box } = this.stage.view;
    box.updateWorldMatrix(true, false);
    return point.applyMatrix4(box.matrixWorld);
  }

  shownPlates(): Plate[] {
    return [this.hud, this.notice, ...this.headUps, ...this.own, ...this.stage.plates].filter(isShown);
  }

  clearTimes(): void {
    this.stage.view.times.clear();
  }

  report(): XrReport {
    const { view } = this.stage;
    const { world } = this.places.grab;
    const { times, drawn } = view;
    return {
      ...this.sessions.state,
      frames: times.count,
      settled: this.framesIn > SETTLED_FRAMES,
      head: view.head.position.toArray(),
      world: { position: world.position.toArray(), orientation: world.orientation.toArray(), scale: world.scale },
      travelling: this.places.travelling,
      menu: { open: this.menu.visible, tab: this.menu.openTab },
      notice: this.notice.text,
      hud: this.hud.text,
      workMs: { p50: times.costMs(0.5), p95: times.costMs(0.95) },
      intervalMs: { p50: times.intervalMs(0.5), p95: times.intervalMs(0.95) },
      ...drawn,
    };
  }

  private watch(): void {
    const { sessions } = this;
    const { xr } = this.stage.view.renderer;
    xr.addEventListener("sessionstart", () => this.begin());
    xr.addEventListener("sessionend", () => this.end());
    sessions.onRecentred = () => (this.framesIn = 0);
  }

  private begin(): void {
    this.framesIn = 0;
    this.stage.view.times.clear();
    this.hud.follower.jump();
    this.saidMs = -Infinity;
    this.showFloor();
  }

  private end(): void {
    this.framesIn = -1;
    this.interaction.reset();
    this.places.restore();
    this.cut.release();
    this.menu.close();
    this.notice.say(null);
    for (const plate of [this.hud, this.wrist]) plate.group.visible = false;
    this.hands.hide();
    this.heart.release();
    this.showBox(true);
    this.showBefore(false);
    this.labels.release();
    this.showFloor();
  }

  /** Puts the heart before a viewer who has just come, once it is known where the viewer is. */
  private arrive(nowMs: number): void {
    if (this.framesIn < 0 || this.framesIn > SETTLED_FRAMES) return;
    if (this.head.position.lengthSq() > 1e-6) this.framesIn += 1;
    if (this.framesIn > SETTLED_FRAMES) this.places.go("table", this.head, nowMs, true);
  }

  private listPlates(): void {
    const { pointable, own } = this;
    pointable.length = 0;
    for (const plate of own) pointable.push(plate);
    for (const plate of this.stage.plates) pointable.push(plate);
  }

  private buttons(): void {
    for (let hand = 0; hand < 2; hand++) {
      const pointer = this.pointers[hand]!;
      let now = 0;
      for (const button of BUTTONS) if (pointer.button(button)) now |= 1 << button;
      const fresh = now & ~this.down[hand]!;
      this.down[hand] = now;
      if (fresh & (1 << BUTTON.upper)) this.menu.toggle(this.head);
      if (fresh & (1 << BUTTON.lower)) this.help();
      if (fresh & (1 << BUTTON.stick)) this.go("table");
      if (pointer.tracked && pointer.bare !== this.bare) {
        this.bare = pointer.bare;
        this.menu.refresh();
      }
    }
  }

  /** Help is one press away, and one press closes it. */
  private help(): void {
    if (this.menu.visible && this.menu.openTab === "Help") this.menu.close();
    else if (this.menu.visible) this.menu.show("Help");
    else this.menu.open(this.head, "Help");
  }

  private say(frame: Frame): void {
    const { hud, notice, stage } = this;
    hud.group.visible = stage.store.value.hud && this.framesIn > SETTLED_FRAMES;
    if (frame.nowMs - this.saidMs >= SAY_EVERY_MS) {
      this.saidMs = frame.nowMs;
      notice.say(this.condition === null ? null : noticeOf(this.condition));
      if (hud.visible) hud.say(hudLines(this.figures(frame.track)));
    }
    if (hud.visible) hud.follower.update(hud, this.head, frame.dtS, this.findRoom());
    for (const plate of this.headUps) {
      if (plate.visible) plate.follower.update(plate, this.head, frame.dtS, this.findRoom(true));
    }
    if (notice.visible) notice.follower.update(notice, this.head, frame.dtS, null);
  }

  /** Where the numbers may stand: not over the heart, nor over what is to be read or pressed; `beside`: nor over the numbers. */
  private findRoom(beside = false): Clearing {
    const { clearing, places, pointable } = this;
    clearing.begin(this.head);
    if (this.stage.world.visible && places.scale < NEARLY_INSIDE) {
      clearing.ball(places.grab.world.apply(this.place.copy(places.centre)), HEART_RADIUS_M * places.scale);
    } else if (this.stage.world.visible && this.stage.tip.valid) {
      // Inside, the heart is all around: what must be seen there is the tip.
      clearing.ball(this.roomFromBox(this.place.setFromMatrixPosition(this.stage.tip.matrix)), TIP_RADIUS_M * places.scale);
    }
    for (const plate of pointable) if (plate !== this.wrist && isShown(plate)) clearing.plate(plate);
    if (beside && this.hud.visible) clearing.plate(this.hud);
    return clearing;
  }

  private figures(track: DrawnTrack | null): Parameters<typeof hudLines>[0] {
    const { readout } = this.stage;
    const shown = track !== null && track.status !== "lost" && this.condition?.stale !== true;
    return {
      status: this.condition ?? { label: "connecting", level: "idle" },
      insertedMm: shown ? lengthOf(track) : null,
      rollRad: shown ? track.roll : null,
      canMendRoll: (this.acts.roll?.view?.action ?? null) !== null,
      delayMs: shown ? track.delayMs : null,
      target: readout.target,
      wall: readout.wall,
    };
  }

  /** The room has a floor of its own: the box's is not drawn over it. */
  private showFloor(): void {
    const through = this.framesIn >= 0 && this.sessions.state.mode === "ar";
    this.stage.view.box.traverse((node) => {
      if (node.name === "floor") node.visible = !through;
    });
  }
}
