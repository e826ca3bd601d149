/** A plate with buttons that stands in a headset's room: before its wearer, to be moved by its bar, pressed by ray, pinch or fingertip. */

import { Box3, Quaternion, Vector3 } from "three";
import type { PointerPhase } from "../../flat/plate";
import type { Stage } from "../../stage/stage";
import type { Rect } from "../../xr/canvas_plate";
import { box, CanvasPlate, contains, INK, write } from "../../xr/canvas_plate";
import { facing } from "../../xr/interaction";
import { levelForward } from "../../xr/placement";
import { raisedM } from "./above";

const SHARPNESS = 2.2;
const REDRAW_MS = 60;
export const BAR_MM = 42;
export const EM = { title: 24, text: 18.2, small: 16.6 } as const;
const bounds = new Box3();
const work = { forward: new Vector3(), place: new Vector3(), turn: new Quaternion() };

/** A button: where it is, mm from the plate's upper left corner, and what it does. */
export interface Spot {
  readonly label: string;
  readonly rect: Rect;
  readonly act: () => void;
  /** What most people press, or what is chosen. */
  readonly main?: boolean;
  readonly disabled?: boolean;
}

export abstract class ButtonPlate extends CanvasPlate {
  private drawnMs = -Infinity;
  private stale = true;
  private hovered: Rect | null = null;
  private shownSpots: readonly Spot[] = [];

  constructor(protected readonly stage: Stage, title: string, widthMm: number, heightMm: number, private readonly belowM = 0.04, private readonly aheadM = 0.68) {
    super(title, widthMm, heightMm, SHARPNESS);
    stage.view.scene.add(this.group);
  }

  /** What can be pressed now. Asked for when the plate is drawn. */
  protected abstract spots(): readonly Spot[];
  protected abstract heading(): string;
  protected abstract paintBody(context: CanvasRenderingContext2D): void;
  /** The cross at the upper right corner was pressed. */
  protected abstract dismiss(): void;

  /** Says that it must be drawn anew. */
  refresh(): void {
    this.stale = true;
  }

  /** Shows or hides itself; called once a frame in a session, and once outside with `wanted` false. */
  follow(wanted: boolean, nowMs: number): void {
    if (!wanted) {
      this.hide();
      return;
    }
    if (!this.group.visible) this.stand();
    // the layout of the pictures makes that list anew when a setting changes, and what is not in it cannot be pressed
    if (!this.stage.plates.includes(this)) this.stage.plates.push(this);
    if (!this.stale || nowMs - this.drawnMs < REDRAW_MS) return;
    this.stale = false;
    this.drawnMs = nowMs;
    this.shownSpots = this.spots();
    this.redraw();
  }

  /** Where a button is, m in the room; null where there is none. For tests. */
  whereIs(label: string): readonly [number, number, number] | null {
    const spot = this.shownSpots.find((each) => each.label === label && each.disabled !== true);
    if (spot === undefined || !this.visible) return null;
    const { x, y, w, h } = spot.rect;
    const at = new Vector3((x + w / 2 - this.widthMm / 2) / 1000, (this.heightMm / 2 - y - h / 2) / 1000, 0);
    return at.applyMatrix4(this.group.matrixWorld).toArray();
  }

  pointer(u: number, v: number, phase: PointerPhase): boolean {
    const x = u * this.widthMm;
    const y = (1 - v) * this.heightMm;
    if (phase === "release" || phase === "drag") return true;
    const closes = contains(this.cross, x, y);
    const spot = this.shownSpots.find(({ rect, disabled }) => disabled !== true && contains(rect, x, y)) ?? null;
    const rect = closes ? this.cross : spot?.rect ?? null;
    if (phase === "move") {
      if (rect !== this.hovered) this.light((this.hovered = rect));
      return true;
    }
    if (closes) this.dismiss();
    else if (spot !== null) spot.act();
    else return y > BAR_MM; // the bar moves the plate
    this.stale = true;
    return true;
  }

  protected paint(context: CanvasRenderingContext2D): void {
    const { widthMm: w, heightMm: h } = this;
    box(context, { x: 0, y: 0, w, h }, 14, INK.panel);
    context.strokeStyle = INK.accent;
    context.lineWidth = 2;
    context.stroke();
    box(context, { x: 0, y: 0, w, h: BAR_MM }, 14, INK.bar);
    write(context, this.heading(), { x: 20, y: 0, w: w - 190, h: BAR_MM }, EM.small, INK.soft);
    write(context, "drag to move", { x: w - 170, y: 0, w: 110, h: BAR_MM }, 14, INK.faint, "right");
    write(context, "×", this.cross, 30, INK.text, "center", 400);
    this.paintBody(context);
    for (const spot of this.shownSpots) paintSpot(context, spot);
  }

  private readonly cross: Rect = { x: this.widthMm - 46, y: 0, w: 46, h: BAR_MM };

  private stand(): void {
    const { head } = this.stage.view;
    levelForward(head, work.forward);
    work.place.copy(head.position).addScaledVector(work.forward, this.aheadM);
    work.place.y -= this.belowM;
    work.place.y += this.aboveTheHeart(head.position);
    this.group.position.copy(work.place);
    this.group.quaternion.copy(facing(work.turn, work.place, head.position));
    this.group.updateMatrixWorld(true);
    this.group.visible = this.stale = true;
    this.drawnMs = -Infinity;
  }

  private aboveTheHeart(head: Vector3): number {
    const thing = this.stage.view.box.getObjectByName("roi");
    if (thing === undefined) return 0;
    const { widthMm, heightMm, aheadM } = this;
    const lowerM = work.place.y - heightMm / 2000;
    return raisedM(bounds.setFromObject(thing), { head, forward: work.forward, aheadM, lowerM, halfWidthM: widthMm / 2000 });
  }

  private hide(): void {
    if (!this.group.visible) return;
    this.group.visible = false;
    this.light((this.hovered = null));
    const index = this.stage.plates.indexOf(this);
    if (index >= 0) this.stage.plates.splice(index, 1);
  }
}

function paintSpot(context: CanvasRenderingContext2D, { label, rect, main, disabled }: Spot): void {
  context.globalAlpha = disabled === true ? 0.4 : 1;
  box(context, rect, 9, main === true ? INK.accent : INK.bar);
  if (main !== true) {
    context.strokeStyle = INK.edge;
    context.lineWidth = 1;
    context.stroke();
  }
  const inner = { x: rect.x + 4, y: rect.y, w: rect.w - 8, h: rect.h };
  write(context, label, inner, EM.text, main === true ? INK.onAccent : INK.text, "center", 600);
  context.globalAlpha = 1;
}
