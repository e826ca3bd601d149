/** What the menu in the scene offers: the page's own settings, the heart's parts, places to stand, and help. No drawing. */

import type { Control } from "../stage/controls";
import { CONTROLS } from "../stage/controls";
import type { Change, SceneSettings, SettingKey, SettingsStore } from "../stage/settings";
import type { Placement } from "./placement";
import { PLACEMENTS } from "./placement";

export type Tab = "View" | "Ultrasound" | "Heart" | "Training" | "Place" | "Help";
export const TABS: readonly Tab[] = ["View", "Ultrasound", "Heart", "Training", "Place", "Help"];

export type Act = { readonly place: Placement } | { readonly leave: true } | { readonly page: number } | { readonly guide: true };

interface Common {
  readonly label: string;
  readonly help: string;
  /** The sentence of the lock that holds it; null: free. */
  readonly locked: string | null;
}

export type Row =
  | (Common & { readonly kind: "toggle"; readonly on: boolean; readonly key: SettingKey | null; readonly part: string | null })
  | (Common & { readonly kind: "choice"; readonly key: SettingKey; readonly value: string; readonly choices: readonly Choice[] })
  | (Common & {
    readonly kind: "slider"; readonly key: SettingKey; readonly value: number; readonly text: string;
    readonly low: number; readonly high: number; readonly step: number;
  })
  | (Common & { readonly kind: "buttons"; readonly buttons: readonly { readonly label: string; readonly act: Act }[] })
  | (Common & { readonly kind: "text" });

export interface Choice {
  readonly value: string;
  readonly label: string;
}

export const ROWS_SHOWN = 7;

export interface Situation {
  readonly store: SettingsStore;
  /** The heart's parts: the name that the settings know them by, and the one that people read. */
  readonly parts: readonly { readonly name: string; readonly label: string }[];
  readonly helpLines: readonly string[];
  readonly canGuide: boolean;
}

/** Returns the rows of a tab, and how many pages of them there are. */
export function rowsOf(tab: Tab, page: number, now: Situation): { rows: Row[]; pages: number } {
  const all = allRows(tab, now);
  if (all.length <= ROWS_SHOWN) return { rows: all, pages: 1 };
  const each = ROWS_SHOWN - 1;
  const pages = Math.ceil(all.length / each);
  const shown = Math.min(page, pages - 1);
  const rows = all.slice(shown * each, (shown + 1) * each);
  return { rows: [...rows, pager(shown, pages)], pages };
}

function allRows(tab: Tab, now: Situation): Row[] {
  if (tab === "Help") return now.helpLines.map((label) => ({ kind: "text", label, help: "", locked: null }));
  if (tab === "Place") return placeRows(now);
  const { store } = now;
  const rows = CONTROLS.filter((each) => each.group === tab && (each.shown?.(store.value) ?? true)).map((each) => rowOf(each, store));
  if (tab === "Heart") rows.push(...partRows(now));
  if (tab === "Ultrasound" && rows.length === 0) {
    rows.push({ kind: "text", label: "Switch Ultrasound (ICE) on under View.", help: "", locked: null });
  }
  return rows;
}

function rowOf(control: Control, store: SettingsStore): Row {
  const { key, label, help } = control;
  const common = { label, help, locked: store.locked(key) ? store.why(key) : null };
  const value = store.value[key];
  if (control.kind === "toggle") return { ...common, kind: "toggle", key, part: null, on: value === true };
  if (control.kind === "choice") return { ...common, kind: "choice", key, value: String(value), choices: control.choices };
  const { low, high, step, unit } = control;
  return { ...common, kind: "slider", key, value: Number(value), text: sliderText(Number(value), step, unit), low, high, step };
}

function partRows({ store, parts }: Situation): Row[] {
  const locked = store.locked("parts") ? store.why("parts") : null;
  return parts.map(({ name, label }) => ({
    kind: "toggle", label, help: "Show or hide this part of the heart", locked, key: null, part: name, on: store.part(name).visible,
  }));
}

function placeRows({ canGuide }: Situation): Row[] {
  const rows: Row[] = [
    { kind: "buttons", label: "Stand", help: "Where the heart is, and how large", locked: null,
      buttons: PLACEMENTS.map(({ name, label }) => ({ label, act: { place: name } })) },
    { kind: "buttons", label: "Reset", help: "Everything back before you, at true scale", locked: null,
      buttons: [{ label: "Put it before me", act: { place: "table" } }] },
    { kind: "buttons", label: "Session", help: "Back to the page", locked: null, buttons: [{ label: "Leave the headset view", act: { leave: true } }] },
  ];
  if (canGuide) {
    rows.splice(2, 0, { kind: "buttons", label: "Guide", help: "What you hold and what you see, step by step", locked: null,
      buttons: [{ label: "Show me round", act: { guide: true } }] });
  }
  return rows;
}

function pager(shown: number, pages: number): Row {
  return {
    kind: "buttons", label: `Page ${shown + 1} of ${pages}`, help: "", locked: null,
    buttons: [{ label: "Back", act: { page: Math.max(0, shown - 1) } }, { label: "More", act: { page: Math.min(pages - 1, shown + 1) } }],
  };
}

function sliderText(value: number, step: number, unit: string): string {
  const digits = step >= 1 ? 0 : step >= 0.1 ? 1 : 2;
  const number = value.toFixed(digits).replace("-", "−");
  return unit === "" ? number : unit === "°" ? `${number}°` : `${number} ${unit}`;
}

/** Returns the change that a slider at `share` (0 to 1) of its way stands for. */
export function slid(row: Extract<Row, { kind: "slider" }>, share: number): Change {
  const raw = row.low + Math.min(1, Math.max(0, share)) * (row.high - row.low);
  const stepped = row.low + Math.round((raw - row.low) / row.step) * row.step;
  return { [row.key]: Number(Math.min(row.high, stepped).toFixed(6)) };
}

/** Returns the change that a press of a toggle stands for; null for a part, which is switched by itself. */
export function toggled(row: Extract<Row, { kind: "toggle" }>, now: SceneSettings): Change | null {
  return row.key === null ? null : { [row.key]: now[row.key] !== true };
}
