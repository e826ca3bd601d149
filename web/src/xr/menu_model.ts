/** What the menu in the scene offers: the page's own settings, the heart's parts, targets, places to stand, help. No drawing. */

import { ARM_PRESETS, armText, sameArm } from "../fluoro/arms";
import type { Control } from "../stage/controls";
import { CONTROLS } from "../stage/controls";
import type { ArmAngles, Change, SceneSettings, SettingKey, SettingsStore } from "../stage/settings";
import type { TrainingAct } from "../training/xr/rows";
import type { RollView } from "../ui/roll";
import type { Placement } from "./placement";
import { PLACEMENTS } from "./placement";

export type Tab = "View" | "Ultrasound" | "Heart" | "Parts" | "Targets" | "Training" | "Place" | "Help";
export const TABS: readonly Tab[] = ["View", "Ultrasound", "Heart", "Parts", "Targets", "Training", "Place", "Help"];
/** Which of the page's groups a tab shows. */
const GROUP: Partial<Record<Tab, Control["group"]>> = { View: "View", Ultrasound: "Ultrasound", Heart: "Heart", Targets: "Training" };

export type Act =
  | { readonly place: Placement } | { readonly leave: true } | { readonly page: number } | { readonly guide: true }
  | { readonly target: TargetAct } | { readonly arm: 0 | 1; readonly by: number } | { readonly parts: "show" | "hide" }
  | { readonly training: TrainingAct } | { readonly roll: true };
export type TargetAct = "next" | "previous" | "add" | "remove";

interface Common {
  readonly label: string;
  readonly help: string;
  /** The sentence of the lock that holds it; null: free. */
  readonly locked: string | null;
}

export type Row =
  | (Common & { readonly kind: "toggle"; readonly on: boolean; readonly key: SettingKey })
  | (Common & { readonly kind: "part"; readonly part: string; readonly on: boolean; readonly opacity: number })
  | (Common & { readonly kind: "choice"; readonly key: SettingKey; readonly value: string; readonly choices: readonly Choice[] })
  | (Common & {
    readonly kind: "slider"; readonly key: SettingKey; readonly value: number; readonly text: string;
    readonly low: number; readonly high: number; readonly step: number;
  })
  | (Common & { readonly kind: "buttons"; readonly buttons: readonly ActButton[] })
  | (Common & { readonly kind: "text" });

export interface ActButton {
  readonly label: string;
  readonly act: Act;
  /** Whether it stands for what is set now. */
  readonly chosen?: boolean;
}

export interface Choice {
  readonly value: string;
  readonly label: string;
}

export const ROWS_SHOWN = 7;
/** As many as a row of text holds without being squeezed. */
const LINE_LETTERS = 62;

export interface Situation {
  readonly store: SettingsStore;
  /** The heart's parts: the name that the settings know them by, and the one that people read. */
  readonly parts: readonly { readonly name: string; readonly label: string }[];
  readonly helpLines: readonly string[];
  readonly canGuide: boolean;
  /** The target in force, and how many there are. */
  readonly target: { readonly name: string; readonly own: boolean; readonly number: number; readonly count: number } | null;
  /** Whether the tip is known: a target can be placed there. */
  readonly tip: boolean;
  /** How far the roll can be trusted; null where nothing is said of it. */
  readonly roll: RollView | null;
  /** The rows of the tab about trials. */
  training(): Row[];
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
  if (tab === "Help") return helpRows(now);
  if (tab === "Place") return placeRows(now);
  if (tab === "Parts") return partRows(now);
  if (tab === "Training") return now.training();
  const { store } = now;
  const controls = CONTROLS.filter(({ group, shown }) => group === GROUP[tab] && (shown?.(store.value) ?? true));
  const rows = controls.map((each) => rowOf(each, store));
  if (tab === "Targets") rows.push(...targetRows(now));
  if (tab === "View" && store.value.mode === "2d") rows.push(armRow(store, 0), armRow(store, 1));
  if (tab === "Ultrasound") rows.unshift(...rollRows(now.roll));
  if (tab === "Ultrasound" && controls.length === 0) {
    rows.push({ kind: "text", label: "Switch Ultrasound (ICE) on under View.", help: "", locked: null });
  }
  return rows;
}

function rowOf(control: Control, store: SettingsStore): Row {
  const { key, label, help } = control;
  const common = { label, help, locked: store.locked(key) ? store.why(key) : null };
  const value = store.value[key];
  if (control.kind === "toggle") return { ...common, kind: "toggle", key, on: value === true };
  if (control.kind === "choice") return { ...common, kind: "choice", key, value: String(value), choices: control.choices };
  const { low, high, step, unit } = control;
  return { ...common, kind: "slider", key, value: Number(value), text: sliderText(Number(value), step, unit), low, high, step };
}

function partRows({ store, parts }: Situation): Row[] {
  const locked = store.locked("parts") ? store.why("parts") : null;
  if (parts.length === 0) return [{ kind: "text", label: "There is no heart in this scene.", help: "", locked: null }];
  const rows: Row[] = parts.map(({ name, label }) => {
    const { visible, opacity } = store.part(name);
    return { kind: "part", label, help: "Show or hide this part; drag for how dense it looks", locked, part: name, on: visible, opacity };
  });
  const all = { kind: "buttons", label: "All parts", help: "Show or hide the whole heart", locked } as const;
  return [{ ...all, buttons: [{ label: "Show all", act: { parts: "show" } }, { label: "Hide all", act: { parts: "hide" } }] }, ...rows];
}

function targetRows({ store, target, tip }: Situation): Row[] {
  const held = store.locked("targets") ? store.why("targets") : null;
  const off = store.value.targets ? null : "Switch Targets on first.";
  const none = target === null ? "There is no target yet: add one." : null;
  const name = target === null ? "No target" : `${target.name} (${target.number} of ${target.count})`;
  const row = { kind: "buttons", help: "" } as const;
  return [
    { kind: "text", label: store.value.targets ? name : "Places to reach, with distance and angle", help: "", locked: null },
    { ...row, label: "In force", help: "Which target counts", locked: held ?? off ?? none,
      buttons: [{ label: "‹ Previous", act: { target: "previous" } }, { label: "Next ›", act: { target: "next" } }] },
    { ...row, label: "Add", help: "A target of your own, where the tip is now",
      locked: held ?? off ?? (tip ? null : "The tip is not tracked now."),
      buttons: [{ label: "At the tip", act: { target: "add" } }] },
    { ...row, label: "Remove", help: "Takes your own target away",
      locked: held ?? off ?? none ?? (target?.own === true ? null : "This one belongs to the scene: it stays."),
      buttons: [{ label: "Remove this one", act: { target: "remove" } }] },
  ];
}

/** The angles that are used often, one after another; any other by dragging the picture. */
function armRow(store: SettingsStore, arm: 0 | 1): Row {
  const { laoDeg, cranialDeg } = store.value.arms[arm];
  return {
    kind: "buttons", label: `Arm ${"AB"[arm]}`, help: "Usual angles one by one; drag the picture for any other",
    locked: store.locked("arms") ? store.why("arms") : null,
    buttons: [
      { label: "‹", act: { arm, by: -1 } }, { label: armText({ laoDeg, cranialDeg }), act: { arm, by: 1 } }, { label: "›", act: { arm, by: 1 } },
    ],
  };
}

/** What the roll lacks, and the press that puts it right where a person can. */
function rollRows(roll: RollView | null): Row[] {
  if (roll === null || roll.detail === "") return [];
  const { detail, hint, action } = roll;
  const rows: Row[] = wrapped(`${detail} ${hint}`, LINE_LETTERS).map((label) => ({ kind: "text", label, help: "", locked: null }));
  if (action !== null) {
    rows.push({ kind: "buttons", label: "Roll", help: "What makes the roll valid again", locked: null, buttons: [{ label: action.label, act: { roll: true } }] });
  }
  return rows;
}

function helpRows({ helpLines, canGuide }: Situation): Row[] {
  const rows: Row[] = helpLines.map((label) => ({ kind: "text", label, help: "", locked: null }));
  return canGuide ? [guideRow(), ...rows] : rows;
}

function guideRow(): Row {
  return { kind: "buttons", label: "Guide", help: "What you hold and what you see, step by step", locked: null,
    buttons: [{ label: "Show me round", act: { guide: true } }] };
}

function placeRows({ canGuide }: Situation): Row[] {
  const rows: Row[] = [
    { kind: "buttons", label: "Stand", help: "Where the heart is, and how large", locked: null,
      buttons: PLACEMENTS.map(({ name, label }) => ({ label, act: { place: name } })) },
    { kind: "buttons", label: "Reset", help: "Everything back before you, at true scale", locked: null,
      buttons: [{ label: "Put it before me", act: { place: "table" } }] },
    { kind: "buttons", label: "Session", help: "Back to the page", locked: null,
      buttons: [{ label: "Leave the headset view", act: { leave: true } }] },
  ];
  if (canGuide) rows.splice(2, 0, guideRow());
  return rows;
}

function pager(shown: number, pages: number): Row {
  return {
    kind: "buttons", label: `Page ${shown + 1} of ${pages}`, help: "", locked: null,
    buttons: [{ label: "Back", act: { page: Math.max(0, shown - 1) } }, { label: "More", act: { page: Math.min(pages - 1, shown + 1) } }],
  };
}

/** Returns words in lines of so many letters at most. */
function wrapped(words: string, letters: number): string[] {
  const lines: string[] = [];
  let line = "";
  for (const word of words.trim().split(" ")) {
    if (line !== "" && line.length + 1 + word.length > letters) {
      lines.push(line);
      line = "";
    }
    line = line === "" ? word : `${line} ${word}`;
  }
  return [...lines, line];
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

/** Returns the change that a press of a toggle stands for. */
export function toggled(row: Extract<Row, { kind: "toggle" }>, now: SceneSettings): Change {
  return { [row.key]: now[row.key] !== true };
}

/** Returns the usual angles of an arm next after (by 1) or before (-1) its present ones. */
export function nextArm(now: ArmAngles, by: number): ArmAngles {
  const at = ARM_PRESETS.findIndex(({ angles }) => sameArm(angles, now));
  if (at < 0) return ARM_PRESETS[0]!.angles;
  return ARM_PRESETS[(at + by + ARM_PRESETS.length) % ARM_PRESETS.length]!.angles;
}
