/** The menu in the scene: a plate with the page's own settings, for a ray, a pinch or a fingertip. */

import { Quaternion, Vector3 } from "three";
import type { PointerPhase } from "../flat/plate";
import type { SettingsStore } from "../stage/settings";
import { CanvasPlate } from "./canvas_plate";
import { facing } from "./interaction";
import { controlRect, HEIGHT, rowRect, segments, shareAlong, spotAt, WIDTH } from "./menu_layout";
import type { Spot } from "./menu_layout";
import type { Act, Row, Situation, Tab } from "./menu_model";
import { rowsOf, slid, toggled } from "./menu_model";
import { paintMenu } from "./menu_paint";
import type { Head } from "./placement";
import { levelForward } from "./placement";

/** Pixels a mm: about 23 a degree, as fine as a present headset shows. */
const SHARPNESS = 2.3;
/** To the right of the heart, at arm's length: neither covers it nor what stands to its left. */
const AHEAD_M = 0.48;
const RIGHT_M = 0.425;
const BELOW_M = 0.14;
/** A dragged slider is drawn anew this often at most. */
const REDRAW_MS = 40;
const work = { forward: new Vector3(), place: new Vector3(), turn: new Quaternion() };

export interface MenuParts {
  readonly store: SettingsStore;
  parts(): readonly { readonly name: string; readonly label: string }[];
  helpLines(): readonly string[];
  /** Whether somebody can be shown round. */
  canGuide(): boolean;
  target(): Situation["target"];
  /** Whether the tip is known. */
  tip(): boolean;
  /** How far the roll can be trusted; null where nothing is said of it. */
  roll(): Situation["roll"];
  training(): Row[];
  onAct(act: Act): void;
}

export class Menu extends CanvasPlate {
  private tab: Tab = "View";
  private page = 0;
  private rows: readonly Row[] = [];
  private hovered: Spot = { kind: "nothing" };
  private footer = "";
  private footerLocked = false;
  /** The slider that is being dragged. */
  private dragging = -1;
  private stale = true;
  private drawnMs = -Infinity;

  constructor(private readonly parts: MenuParts) {
    super("menu", WIDTH, HEIGHT, SHARPNESS);
    parts.store.listen(() => (this.stale = true));
  }

  /** What its rows say first, as drawn last; for tests. */
  get labels(): string[] {
    return this.rows.map(({ label }) => label);
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
    work.place.x -= RIGHT_M * work.forward.z; // right of (x, z) is (-z, x)
    work.place.z += RIGHT_M * work.forward.x;
    work.place.y -= BELOW_M;
    this.group.position.copy(work.place);
    this.group.quaternion.copy(facing(work.turn, work.place, head.position));
    this.group.updateMatrixWorld(true);
    this.group.visible = true;
  }

  close(): void {
    this.group.visible = false;
    this.dragging = -1;
    this.light(null);
  }

  show(tab: Tab, page = 0): void {
    if (tab !== this.tab || page !== this.page) this.footer = "";
    this.tab = tab;
    this.page = page;
    this.hovered = { kind: "nothing" };
    this.light(null);
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

  /** Returns where a row's own control (or a segment of it) is, u and v; for tests and for the guide. null: no such row. */
  whereIs(label: string, segment = -1): readonly [number, number] | null {
    const index = this.rows.findIndex((row) => row.label === label);
    if (index < 0) return null;
    const row = this.rows[index]!;
    const rect = rowRect(index);
    let x = row.kind === "slider" ? rect.x + 290 : rect.x + rect.w - 45;
    if (row.kind === "part" && segment === 0) x = controlRect(row, rect).x + 65;
    else if ((row.kind === "choice" || row.kind === "buttons") && segment >= 0) {
      const part = segments(row, rect)[segment]!;
      x = part.x + part.w / 2;
    }
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
    const { parts, helpLines, canGuide, target, tip, roll, training } = this.parts;
    return { store, parts: parts(), helpLines: helpLines(), canGuide: canGuide(), target: target(), tip: tip(), roll: roll(), training };
  }

  /** Lights up what is pointed at, and says in a sentence what it does. */
  private point(spot: Spot): void {
    if (sameSpot(spot, this.hovered)) return;
    this.hovered = spot;
    const rect = spot.kind === "row" || spot.kind === "tab" ? spot.rect : null;
    const row = spot.kind === "row" ? this.rows[spot.index] : undefined;
    this.light(row?.kind === "text" ? null : rect);
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
      store.set(toggled(row, store.value));
    } else if (row.kind === "part" && spot.segment === 1) {
      store.setPart(row.part, { visible: !row.on });
    } else if (row.kind === "choice" && spot.segment >= 0) {
      store.set({ [row.key]: row.choices[spot.segment]!.value });
    } else if (row.kind === "buttons" && spot.segment >= 0) {
      const { act } = row.buttons[spot.segment]!;
      if ("page" in act) this.show(this.tab, act.page);
      else this.parts.onAct(act);
    } else if (row.kind === "slider" || row.kind === "part") {
      this.dragging = spot.index;
      this.drag(x);
    }
  }

  private drag(x: number): void {
    const row = this.rows[this.dragging];
    const { store } = this.parts;
    if (row?.kind === "slider") store.set(slid(row, shareAlong(row, this.dragging, x)));
    else if (row?.kind !== "part") this.dragging = -1;
    else store.setPart(row.part, { visible: true, opacity: Math.round(50 * shareAlong(row, this.dragging, x)) / 50 });
  }
}

function sameSpot(a: Spot, b: Spot): boolean {
  if (a.kind === "row" && b.kind === "row") return a.index === b.index && a.segment === b.segment;
  return a.kind === "tab" && b.kind === "tab" ? a.tab === b.tab : a.kind === b.kind;
}
