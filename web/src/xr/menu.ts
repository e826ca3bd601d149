/** The menu in the scene: a plate with the page's own settings, for a ray, a pinch or a fingertip. */

import { Mesh, MeshBasicMaterial, PlaneGeometry, Quaternion, Vector3 } from "three";
import type { PointerPhase } from "../flat/plate";
import type { SettingsStore } from "../stage/settings";
import { CanvasPlate, PLATE_ORDER } from "./canvas_plate";
import { facing } from "./interaction";
import { HEIGHT, rowRect, shareAlong, spotAt, WIDTH } from "./menu_layout";
import type { Spot } from "./menu_layout";
import type { Act, Row, Situation, Tab } from "./menu_model";
import { rowsOf, slid, toggled } from "./menu_model";
import { paintMenu } from "./menu_paint";
import type { Head } from "./placement";
import { levelForward } from "./placement";

/** Pixels a mm: about 23 a degree, as fine as a present headset shows. */
const SHARPNESS = 2.3;
const AHEAD_M = 0.55;
const BELOW_M = 0.12;
/** A dragged slider is drawn anew this often at most. */
const REDRAW_MS = 40;
const work = { forward: new Vector3(), place: new Vector3(), turn: new Quaternion() };

export interface MenuParts {
  readonly store: SettingsStore;
  parts(): readonly { readonly name: string; readonly label: string }[];
  helpLines(): readonly string[];
  /** Whether somebody can be shown round. */
  canGuide(): boolean;
  onAct(act: Act): void;
}

export class Menu extends CanvasPlate {
  private tab: Tab = "View";
  private page = 0;
  private rows: readonly Row[] = [];
  private readonly hover: Mesh;
  private hovered: Spot = { kind: "nothing" };
  private footer = "";
  private footerLocked = false;
  /** The slider that is being dragged. */
  private dragging = -1;
  private stale = true;
  private drawnMs = -Infinity;

  constructor(private readonly parts: MenuParts) {
    super("menu", WIDTH, HEIGHT, SHARPNESS);
    this.hover = new Mesh(
      new PlaneGeometry(1, 1),
      new MeshBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.09, depthWrite: false, toneMapped: false }),
    );
    this.hover.renderOrder = PLATE_ORDER + 1;
    this.hover.visible = false;
    this.group.add(this.hover);
    parts.store.listen(() => (this.stale = true));
  }

  get openTab(): Tab {
    return this.tab;
  }

  /** Opens before somebody's eyes, a little below, or closes. */
  toggle(head: Head): void {
    if (this.visible) this.close();
    else this.open(head);
  }

  open(head: Head, tab: Tab = this.tab): void {
    this.show(tab);
    levelForward(head, work.forward);
    work.place.copy(head.position).addScaledVector(work.forward, AHEAD_M);
    work.place.y -= BELOW_M;
    this.group.position.copy(work.place);
    this.group.quaternion.copy(facing(work.turn, work.place, head.position));
    this.group.updateMatrixWorld(true);
    this.group.visible = true;
  }

  close(): void {
    this.group.visible = false;
    this.dragging = -1;
    this.hover.visible = false;
  }

  show(tab: Tab, page = 0): void {
    if (tab !== this.tab || page !== this.page) this.footer = "";
    this.tab = tab;
    this.page = page;
    this.hovered = { kind: "nothing" };
    this.hover.visible = false;
    this.stale = true;
  }

  /** Draws itself anew if it must. Called once a frame while a session runs. */
  update(nowMs: number): void {
    if (!this.visible || !this.stale || nowMs - this.drawnMs < REDRAW_MS) return;
    this.stale = false;
    this.drawnMs = nowMs;
    this.rows = rowsOf(this.tab, this.page, this.situation()).rows;
    this.redraw();
  }

  /** Says that what it shows besides the settings has changed: the heart's parts, or the kind of hands. */
  refresh(): void {
    this.stale = true;
  }

  /** Returns where the middle of a row's own control is, u and v; for tests and for the guide. null: no such row. */
  whereIs(label: string): readonly [number, number] | null {
    const index = this.rows.findIndex((row) => row.label === label);
    if (index < 0) return null;
    const rect = rowRect(index);
    const x = this.rows[index]!.kind === "slider" ? rect.x + 260 : rect.x + rect.w - 45;
    return [x / WIDTH, 1 - (rect.y + rect.h / 2) / HEIGHT];
  }

  pointer(u: number, v: number, phase: PointerPhase): boolean {
    const x = u * WIDTH;
    const y = (1 - v) * HEIGHT;
    if (phase === "release") {
      this.dragging = -1;
      return true;
    }
    if (this.dragging >= 0) {
      this.drag(x);
      return true;
    }
    const spot = spotAt(this.rows, x, y);
    this.point(spot);
    return phase === "press" ? this.press(spot, x) : true; // held on a switch, a press is still one press
  }

  protected paint(context: CanvasRenderingContext2D): void {
    paintMenu(context, { tab: this.tab, rows: this.rows, footer: this.footer, locked: this.footerLocked });
  }

  private situation(): Situation {
    const { store } = this.parts;
    return { store, parts: this.parts.parts(), helpLines: this.parts.helpLines(), canGuide: this.parts.canGuide() };
  }

  /** Lights up what is pointed at, and says in a sentence what it does. */
  private point(spot: Spot): void {
    if (sameSpot(spot, this.hovered)) return;
    this.hovered = spot;
    const rect = spot.kind === "row" || spot.kind === "tab" ? spot.rect : null;
    const row = spot.kind === "row" ? this.rows[spot.index] : undefined;
    this.hover.visible = rect !== null && row?.kind !== "text";
    if (rect !== null) {
      this.hover.scale.set(rect.w / 1000, rect.h / 1000, 1);
      this.hover.position.set((rect.x + rect.w / 2 - WIDTH / 2) / 1000, (HEIGHT / 2 - rect.y - rect.h / 2) / 1000, 0.001);
    }
    if (row === undefined) return;
    const footer = row.locked ?? row.help;
    if (footer === this.footer) return;
    this.footer = footer;
    this.footerLocked = row.locked !== null;
    this.stale = true;
  }

  private press(spot: Spot, x: number): boolean {
    if (spot.kind === "bar") return false; // what is pressed there moves the menu
    if (spot.kind === "close") this.close();
    if (spot.kind === "tab") this.show(spot.tab);
    if (spot.kind === "row") this.pressRow(spot, x);
    return true;
  }

  private pressRow(spot: Extract<Spot, { kind: "row" }>, x: number): void {
    const row = this.rows[spot.index];
    const { store } = this.parts;
    if (row === undefined || row.locked !== null) return;
    if (row.kind === "toggle") {
      const change = toggled(row, store.value);
      if (change !== null) store.set(change);
      else if (row.part !== null) store.setPart(row.part, { visible: !row.on });
    } else if (row.kind === "choice" && spot.segment >= 0) {
      store.set({ [row.key]: row.choices[spot.segment]!.value });
    } else if (row.kind === "buttons" && spot.segment >= 0) {
      const { act } = row.buttons[spot.segment]!;
      if ("page" in act) this.show(this.tab, act.page);
      else this.parts.onAct(act);
    } else if (row.kind === "slider") {
      this.dragging = spot.index;
      this.drag(x);
    }
  }

  private drag(x: number): void {
    const row = this.rows[this.dragging];
    if (row?.kind !== "slider") this.dragging = -1;
    else this.parts.store.set(slid(row, shareAlong(row, this.dragging, x)));
  }
}

function sameSpot(a: Spot, b: Spot): boolean {
  if (a.kind === "row" && b.kind === "row") return a.index === b.index;
  return a.kind === "tab" && b.kind === "tab" ? a.tab === b.tab : a.kind === b.kind;
}
