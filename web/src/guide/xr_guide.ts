/** The guide in a headset: a plate above the heart, for ray, pinch or fingertip, and a line to what is meant. */

import {
  BufferAttribute, BufferGeometry, DynamicDrawUsage, LineBasicMaterial, LineSegments, Quaternion, Vector3,
} from "three";
import type { PointerPhase } from "../flat/plate";
import type { Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import type { Rect } from "../xr/canvas_plate";
import { box, CanvasPlate, contains, INK, PLATE_ORDER, write } from "../xr/canvas_plate";
import type { Immersion } from "../xr/immersion";
import { facing } from "../xr/interaction";
import { levelForward } from "../xr/placement";
import { scenePoint } from "./anchor";
import type { Guide } from "./guide";
import type { Steers } from "./sensor";
import type { Anchor, Step } from "./steps";
import { wordsOf } from "./steps";
import type { Spot } from "./xr_layout";
import { BAR, CLOSE, FIGURE, HEIGHT, NAVIGATION, PROGRESS, SKIP, steerSpots, TEXT, TITLE, WIDTH, wrapped } from "./xr_layout";

const SHARPNESS = 2.2;
/** Ahead, above the heart: between the picture on the left and the menu on the right. */
const AHEAD_M = 0.7;
const BELOW_M = 0.03;
const REDRAW_MS = 60;
const SETTLE_MS = 800;
const RING_M = 0.016;
const RING_STEPS = 28;
const EM = { title: 24, text: 18.2, small: 16.6 } as const;
const GOLD = 0xffd166;
const work = { forward: new Vector3(), place: new Vector3(), turn: new Quaternion(), at: new Vector3(), edge: new Vector3(), side: new Vector3(), up: new Vector3() };

export class XrGuide extends CanvasPlate {
  private readonly places = new BufferAttribute(new Float32Array(6 * (RING_STEPS + 1)), 3).setUsage(DynamicDrawUsage);
  private readonly line: LineSegments<BufferGeometry, LineBasicMaterial>;
  private version = -1;
  private drawnMs = -Infinity;
  private beganMs = NaN;
  private stood = false;
  private shownSpots: readonly Spot[] = [];
  private spotted = -1;
  private held: Spot | null = null;
  private hovered: Rect | null = null;

  constructor(
    private readonly guide: Guide, private readonly stage: Stage, private readonly immersion: Immersion, private readonly steers: Steers,
  ) {
    super("guide", WIDTH, HEIGHT, SHARPNESS);
    this.line = new LineSegments(
      new BufferGeometry().setAttribute("position", this.places),
      new LineBasicMaterial({ color: GOLD, transparent: true, opacity: 0.9, depthTest: false, toneMapped: false }),
    );
    this.line.frustumCulled = false;
    this.line.renderOrder = PLATE_ORDER + 3;
    this.line.visible = false;
    stage.view.scene.add(this.group, this.line);
  }

  /** Puts itself above the heart again, as at the beginning. */
  stand(): void {
    this.stood = false;
  }

  /** Where a button is, m in the room; null where there is none. For tests. */
  whereIs(label: string): readonly [number, number, number] | null {
    const spot = this.spots().find((each) => each.label === label);
    if (spot === undefined || !this.visible) return null;
    const { x, y, w, h } = spot.rect;
    return new Vector3((x + w / 2 - WIDTH / 2) / 1000, (HEIGHT / 2 - y - h / 2) / 1000, 0).applyMatrix4(this.group.matrixWorld).toArray();
  }

  update(frame: Frame): void {
    const { guide, stage } = this;
    if (!frame.immersive) this.beganMs = NaN;
    else if (Number.isNaN(this.beganMs)) this.beganMs = frame.nowMs;
    const shown = frame.immersive && guide.phase !== "idle" && frame.nowMs - this.beganMs > SETTLE_MS;
    if (!shown) {
      this.hide();
      return;
    }
    if (!stage.plates.includes(this)) stage.plates.push(this);
    this.steer(frame.dtS);
    if (!this.stood) this.standBy();
    this.group.visible = true;
    if (this.version !== guide.version && frame.nowMs - this.drawnMs > REDRAW_MS) {
      this.version = guide.version;
      this.drawnMs = frame.nowMs;
      this.redraw();
    }
    this.point();
  }

  pointer(u: number, v: number, phase: PointerPhase): boolean {
    const x = u * WIDTH;
    const y = (1 - v) * HEIGHT;
    if (phase === "release") {
      this.held = null;
      this.version = -1;
      return true;
    }
    if (phase === "drag") return true;
    const spot = this.spots().find(({ rect }) => contains(rect, x, y)) ?? null;
    if (phase === "move") {
      if (spot?.rect !== this.hovered) this.light((this.hovered = spot?.rect ?? null));
      return true;
    }
    if (spot === null) return y > BAR.h; // the bar moves the plate
    this.press(spot);
    return true;
  }

  protected paint(context: CanvasRenderingContext2D): void {
    const { guide } = this;
    const { step } = guide;
    box(context, { x: 0, y: 0, w: WIDTH, h: HEIGHT }, 14, INK.panel);
    context.strokeStyle = guide.done ? INK.good : INK.accent;
    context.lineWidth = 2.5;
    context.stroke();
    box(context, BAR, 14, INK.bar);
    const count = step === null ? "Guide" : `Guide · ${guide.index + 1} of ${guide.steps.length}`;
    write(context, count, { x: 20, y: 0, w: 220, h: BAR.h }, EM.small, INK.soft);
    write(context, "drag to move", { x: 220, y: 0, w: CLOSE.x - 234, h: BAR.h }, 14, INK.faint, "right");
    write(context, "×", CLOSE, 30, INK.text, "center", 400);
    if (step === null) this.paintOffer(context);
    else this.paintStep(context, step);
    for (const spot of this.spots()) if (spot.rect !== CLOSE) this.paintButton(context, spot);
  }

  private paintOffer(context: CanvasRenderingContext2D): void {
    const at = this.guide.resumesAt;
    write(context, at === null ? "First time in here?" : "Go on with the guide?", TITLE, EM.title, INK.text, "left", 650);
    this.paintText(context, at === null
      ? "In two minutes you learn by doing: move the catheter, take the heart in your hand, see with ultrasound, reach a target."
      : `You were at step ${at} of ${this.guide.steps.length}.`);
  }

  private paintStep(context: CanvasRenderingContext2D, step: Step): void {
    const { guide } = this;
    const { trial, done } = guide;
    write(context, step.title, TITLE, EM.title, INK.text, "left", 650);
    this.paintText(context, wordsOf(step, guide.situation));
    if (done) {
      this.paintTick(context);
      write(context, step.praise, { ...PROGRESS, x: PROGRESS.x + 36, w: WIDTH - 2 * PROGRESS.x - 36 }, EM.text, INK.good, "left", 600);
      return;
    }
    if (trial.task.kind === "read" || guide.progress === "") return;
    if (trial.task.kind === "setting" || trial.task.kind === "taken") {
      write(context, guide.progress, { ...PROGRESS, w: WIDTH - 2 * PROGRESS.x }, EM.text, INK.text, "left", 600);
      return;
    }
    const track = { x: PROGRESS.x, y: PROGRESS.y + PROGRESS.h / 2 - 5, w: FIGURE.x - PROGRESS.x - 14, h: 10 };
    box(context, track, 5, INK.track);
    if (trial.share > 0.02) box(context, { ...track, w: track.w * trial.share }, 5, INK.accent);
    write(context, guide.progress, FIGURE, EM.text, INK.text, "right", 600);
  }

  private paintText(context: CanvasRenderingContext2D, text: string): void {
    const lines = wrapped(context, text, TEXT.w, EM.text);
    lines.forEach((line, index) => write(context, line, { x: TEXT.x, y: TEXT.y + index * 25, w: TEXT.w, h: 25 }, EM.text, INK.text, "left", 450));
  }

  private paintTick(context: CanvasRenderingContext2D): void {
    const { x, y, h } = PROGRESS;
    context.beginPath();
    context.moveTo(x + 3, y + h / 2);
    context.lineTo(x + 10, y + h / 2 + 8);
    context.lineTo(x + 24, y + h / 2 - 9);
    context.strokeStyle = INK.good;
    context.lineWidth = 4;
    context.stroke();
  }

  private paintButton(context: CanvasRenderingContext2D, { label, rect, main }: Spot): void {
    const ready = main === true && (this.guide.done || this.guide.trial.task.kind === "read" || this.guide.step === null);
    const down = this.held?.rect === rect;
    box(context, rect, 9, ready || down ? INK.accent : INK.bar);
    context.strokeStyle = main === true ? INK.accent : INK.edge;
    context.lineWidth = 1.5;
    context.stroke();
    write(context, label, { x: rect.x + 6, y: rect.y, w: rect.w - 12, h: rect.h }, EM.text, ready || down ? INK.onAccent : INK.text, "center", 600);
  }

  /** Everything that can be pressed now. */
  private spots(): readonly Spot[] {
    if (this.spotted !== this.guide.version) this.shownSpots = this.findSpots();
    this.spotted = this.guide.version;
    return this.shownSpots;
  }

  private findSpots(): readonly Spot[] {
    const { guide } = this;
    const { step } = guide;
    const close: Spot = { label: "×", rect: CLOSE };
    if (step === null) return [close, { label: "Not now", rect: SKIP }, { label: guide.resumesAt === null ? "Show me" : "Go on", rect: NAVIGATION.next, main: true }];
    const shown: Spot[] = [close];
    if (guide.situation.mover === "twin" && step.steers !== undefined) shown.push(...steerSpots(step.steers));
    if (!guide.last) shown.push({ label: "Skip the guide", rect: SKIP });
    if (guide.index > 0) shown.push({ label: "Back", rect: NAVIGATION.back });
    shown.push({ label: guide.last ? "Done" : "Next", rect: NAVIGATION.next, main: true });
    return shown;
  }

  private press(spot: Spot): void {
    const { guide } = this;
    if (spot.control !== undefined) {
      this.held = spot;
      this.version = -1;
    } else if (spot.rect === NAVIGATION.next) guide.next();
    else if (spot.rect === NAVIGATION.back) guide.back();
    else guide.skip();
  }

  /** Moves the twin while a button is held. */
  private steer(dtS: number): void {
    const { held } = this;
    if (held?.control === undefined) return;
    if (!this.spots().some(({ rect }) => rect === held.rect)) this.held = null; // the step has changed under the finger
    else this.steers.nudge(held.control, held.speed! * dtS);
  }

  private standBy(): void {
    const { head } = this.stage.view;
    this.stood = true;
    levelForward(head, work.forward);
    work.place.copy(head.position).addScaledVector(work.forward, AHEAD_M);
    work.place.y -= BELOW_M;
    this.group.position.copy(work.place);
    this.group.quaternion.copy(facing(work.turn, work.place, head.position));
    this.group.updateMatrixWorld(true);
  }

  private hide(): void {
    this.held = null;
    this.stood = false;
    this.line.visible = false;
    if (!this.group.visible) return;
    this.group.visible = false;
    const index = this.stage.plates.indexOf(this);
    if (index >= 0) this.stage.plates.splice(index, 1);
  }

  /** Draws the line from the plate's nearest edge to the anchor, and a ring about that. */
  private point(): void {
    const { guide, group } = this;
    const anchor = guide.done ? null : guide.step?.look(guide.situation) ?? null;
    this.line.visible = anchor !== null && this.findAnchor(work.at, anchor);
    if (!this.line.visible) return;
    const { edge, at } = work;
    group.worldToLocal(edge.copy(at));
    edge.set(clamp(edge.x, WIDTH / 2000), clamp(edge.y, HEIGHT / 2000), 0);
    group.localToWorld(edge);
    const { position } = this.stage.view.head;
    facing(work.turn, at, position);
    work.side.set(RING_M, 0, 0).applyQuaternion(work.turn);
    work.up.set(0, RING_M, 0).applyQuaternion(work.turn);
    work.forward.subVectors(edge, at);
    const away = work.forward.length();
    if (away > RING_M) work.forward.multiplyScalar(RING_M / away); // the line ends at the ring
    this.places.setXYZ(0, edge.x, edge.y, edge.z);
    this.places.setXYZ(1, at.x + work.forward.x, at.y + work.forward.y, at.z + work.forward.z);
    for (let i = 0; i < RING_STEPS; i++) {
      this.putRing(2 * i + 2, i);
      this.putRing(2 * i + 3, i + 1);
    }
    this.places.needsUpdate = true;
  }

  private putRing(index: number, step: number): void {
    const { at, side, up } = work;
    const c = COSINES[step]!;
    const s = SINES[step]!;
    this.places.setXYZ(index, at.x + c * side.x + s * up.x, at.y + c * side.y + s * up.y, at.z + c * side.z + s * up.z);
  }

  /** Writes where an anchor is, m in the room. */
  private findAnchor(out: Vector3, anchor: Anchor): boolean {
    const { stage, immersion } = this;
    if ("scene" in anchor) {
      if (anchor.scene !== "heart") return scenePoint(out, stage, anchor.scene);
      immersion.places.grab.world.apply(out.copy(immersion.places.centre));
      return true;
    }
    if ("element" in anchor) return false;
    if (anchor.plate === "picture") {
      const picture = stage.plates.find((plate) => plate !== this);
      if (picture === undefined) return false;
      out.setFromMatrixPosition(picture.group.matrixWorld);
      return true;
    }
    if (immersion.menu.visible) return false; // it is before one's eyes
    const hand = immersion.pointers.find((pointer) => pointer.tracked && (!pointer.bare || pointer.left));
    if (hand === undefined) return false;
    out.copy(hand.position);
    return true;
  }
}

const COSINES = Float64Array.from({ length: RING_STEPS + 1 }, (_, i) => Math.cos((2 * Math.PI * i) / RING_STEPS));
const SINES = Float64Array.from({ length: RING_STEPS + 1 }, (_, i) => Math.sin((2 * Math.PI * i) / RING_STEPS));

function clamp(value: number, most: number): number {
  return Math.min(most, Math.max(-most, value));
}
