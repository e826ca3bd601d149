/** Where everything on the menu is, mm from its upper left corner. No drawing. */

import type { Rect } from "./canvas_plate";
import { contains } from "./canvas_plate";
import type { Row, Tab } from "./menu_model";
import { ROWS_SHOWN, TABS } from "./menu_model";

export const WIDTH = 570;
const BAR = 46;
const TAB = 44;
const ROW = 42;
const GAP = 4;
const FOOT = 40;
const MARGIN = 12;
export const HEIGHT = BAR + TAB + ROWS_SHOWN * (ROW + GAP) + FOOT + 2 * GAP;

/** Widths of what names a row. */
const LABEL = { toggle: 360, buttons: 96, part: 176, choice: 170, slider: 170 } as const;

/** Heights of letters' em, mm. Seen from arm's length (0.6 m) a capital (0.7 em) of the smaller is 1.1 degrees high. */
export const EM = { large: 18.5, small: 16.6 } as const;

export const TITLE_BAR: Rect = { x: 0, y: 0, w: WIDTH - BAR, h: BAR };
export const CLOSE: Rect = { x: WIDTH - BAR, y: 0, w: BAR, h: BAR };
export const FOOTER: Rect = { x: MARGIN, y: HEIGHT - FOOT, w: WIDTH - 2 * MARGIN, h: FOOT };

type TabPlace = Extract<Spot, { kind: "tab" }>;
const CLOSING: Spot = { kind: "close" };
const MOVING: Spot = { kind: "bar" };
const NOTHING: Spot = { kind: "nothing" };
/** Places are asked for in every frame in which somebody points at the menu: they are made once. */
const TAB_PLACES: readonly TabPlace[] = placeTabs();
const ROW_PLACES: readonly Rect[] = Array.from({ length: ROWS_SHOWN }, (_, index) => placeRow(index));
const SEGMENTS = new WeakMap<Row, { readonly rect: Rect; readonly places: readonly Rect[] }>();

/** Returns the tabs' places: as wide as their names. */
export function tabRects(): readonly TabPlace[] {
  return TAB_PLACES;
}

function placeTabs(): TabPlace[] {
  const places = shareOut(TABS.map((tab) => tab.length + 1.9), { x: GAP, y: BAR, w: WIDTH - 2 * GAP, h: TAB });
  return TABS.map((tab, index) => ({ kind: "tab", tab, rect: places[index]! }));
}

export function rowRect(index: number): Rect {
  return ROW_PLACES[index] ?? placeRow(index);
}

function placeRow(index: number): Rect {
  return { x: GAP, y: BAR + TAB + GAP + index * (ROW + GAP), w: WIDTH - 2 * GAP, h: ROW };
}

export function labelRect(row: Row, rect: Rect): Rect {
  const w = row.kind === "text" ? rect.w - 2 * MARGIN : LABEL[row.kind];
  return { x: rect.x + MARGIN, y: rect.y, w, h: rect.h };
}

/** Where the parts of a row's own control are: a switch, a track and its number, or segments. */
export function controlRect(row: Row, rect: Rect): Rect {
  const label = labelRect(row, rect);
  const x = label.x + label.w + 6;
  if (row.kind === "toggle") return switchRect(rect);
  if (row.kind === "part") return { x, y: rect.y, w: 130, h: rect.h };
  if (row.kind === "slider") return { x, y: rect.y, w: 190, h: rect.h };
  return { x, y: rect.y + 3, w: rect.x + rect.w - 6 - x, h: rect.h - 6 };
}

/** A part's switch, behind its slider and its number. */
export function switchRect(rect: Rect): Rect {
  return { x: rect.x + rect.w - 78, y: rect.y + 7, w: 66, h: rect.h - 14 };
}

export function partNumberRect(rect: Rect): Rect {
  return { x: rect.x + rect.w - 150, y: rect.y, w: 62, h: rect.h };
}

export function numberRect(rect: Rect): Rect {
  return { x: rect.x + rect.w - 92, y: rect.y, w: 82, h: rect.h };
}

/** Returns the places of a choice's or of buttons' segments. */
export function segments(row: Extract<Row, { kind: "choice" | "buttons" }>, rect: Rect): readonly Rect[] {
  const known = SEGMENTS.get(row);
  if (known?.rect === rect) return known.places;
  const names = row.kind === "choice" ? row.choices : row.buttons;
  const places = shareOut(names.map(({ label }) => label.length + 3), controlRect(row, rect));
  SEGMENTS.set(row, { rect, places });
  return places;
}

function shareOut(weights: readonly number[], whole: Rect): Rect[] {
  const sum = weights.reduce((total, each) => total + each, 0);
  const room = whole.w - GAP * (weights.length - 1);
  let { x } = whole;
  return weights.map((weight) => {
    const rect = { x, y: whole.y, w: (room * weight) / sum, h: whole.h };
    x += rect.w + GAP;
    return rect;
  });
}

export type Spot =
  | { readonly kind: "bar" } | { readonly kind: "close" } | { readonly kind: "tab"; readonly tab: Tab; readonly rect: Rect }
  | { readonly kind: "row"; readonly index: number; readonly rect: Rect; readonly segment: number }
  | { readonly kind: "nothing" };

/** Returns what is at a place. segment: which of a choice or of buttons, -1 beside them; of a part 0 its slider, 1 its switch. */
export function spotAt(rows: readonly Row[], x: number, y: number): Spot {
  if (contains(CLOSE, x, y)) return CLOSING;
  if (contains(TITLE_BAR, x, y)) return MOVING;
  for (const place of TAB_PLACES) if (contains(place.rect, x, y)) return place;
  for (let index = 0; index < rows.length; index++) {
    const rect = rowRect(index);
    if (contains(rect, x, y)) return { kind: "row", index, rect, segment: segmentAt(rows[index]!, rect, x, y) };
  }
  return NOTHING;
}

function segmentAt(row: Row, rect: Rect, x: number, y: number): number {
  if (row.kind === "part") {
    const slider = controlRect(row, rect);
    return x < slider.x + slider.w + 8 ? 0 : 1;
  }
  if (row.kind !== "choice" && row.kind !== "buttons") return -1;
  const places = segments(row, rect);
  for (let index = 0; index < places.length; index++) if (contains(places[index]!, x, y)) return index;
  return -1;
}

/** Returns how far along a slider's track a place is, 0 to 1. */
export function shareAlong(row: Row, index: number, x: number): number {
  const track = trackRect(controlRect(row, rowRect(index)));
  return Math.min(1, Math.max(0, (x - track.x) / track.w));
}

/** The track itself lies within the control with room for the knob at both ends. */
export function trackRect(control: Rect): Rect {
  return { x: control.x + 10, y: control.y + control.h / 2 - 3, w: control.w - 20, h: 6 };
}
