/** Rows of the page for the scene's settings: one for each of CONTROLS, held in step with the store. */

import type { ChoiceControl, Control, SliderControl } from "../stage/controls";
import { CONTROLS } from "../stage/controls";
import type { Change, SceneSettings, SettingsStore } from "../stage/settings";
import { make, setText } from "./dom";

/** One setting's row. */
interface Row {
  readonly control: Control;
  readonly element: HTMLElement;
  /** Shows a value, and whether and why it is held fast. */
  show(now: SceneSettings, locked: boolean, why: string): void;
}

/** Fills every element with `data-controls="View Training"` with the settings of these groups. */
export class ControlRows {
  private readonly rows: Row[] = [];
  private readonly hosts: HTMLElement[];

  constructor(private readonly store: SettingsStore, root: ParentNode = document) {
    this.hosts = [...root.querySelectorAll<HTMLElement>("[data-controls]")];
    for (const host of this.hosts) {
      const groups = host.dataset["controls"]!.split(" ");
      const rows = CONTROLS.filter(({ group }) => groups.includes(group)).map((control) => this.makeRow(control));
      host.replaceChildren(...rows.map((row) => row.element));
      this.rows.push(...rows);
    }
    store.listen(() => this.refresh());
    this.refresh();
  }

  private refresh(): void {
    const now = this.store.value;
    for (const row of this.rows) {
      const { key, shown } = row.control;
      row.element.hidden = shown !== undefined && !shown(now);
      if (!row.element.hidden) row.show(now, this.store.locked(key), this.store.why(key));
    }
  }

  private makeRow(control: Control): Row {
    const set = (value: unknown): void => this.store.set({ [control.key]: value } as Change);
    const row = control.kind === "toggle" ? makeToggle(control, set)
      : control.kind === "choice" ? makeChoice(control, set)
      : makeSlider(control, set);
    row.element.dataset["setting"] = control.key;
    return row;
  }
}

function makeToggle(control: Control, set: (value: boolean) => void): Row {
  const element = make("label", "control toggle");
  const box = make("input");
  box.type = "checkbox";
  box.id = `set-${control.key}`;
  box.addEventListener("input", () => set(box.checked));
  element.append(box, make("span", "", control.label));
  return {
    control,
    element,
    show: (now, locked, why) => {
      box.checked = now[control.key] === true;
      hold(element, [box], locked, why || control.help);
    },
  };
}

function makeChoice(control: ChoiceControl, set: (value: string) => void): Row {
  const element = make("div", "control choice");
  const name = make("span", "", control.label);
  name.id = `set-${control.key}-label`;
  const group = make("div", "segments");
  group.setAttribute("role", "radiogroup");
  group.setAttribute("aria-labelledby", name.id);
  const buttons = control.choices.map(({ value, label }) => {
    const choice = make("label");
    const radio = make("input");
    radio.type = "radio";
    radio.name = `set-${control.key}`;
    radio.value = value;
    radio.addEventListener("input", () => set(value));
    choice.append(radio, make("span", "", label));
    group.append(choice);
    return radio;
  });
  element.append(name, group);
  return {
    control,
    element,
    show: (now, locked, why) => {
      for (const radio of buttons) radio.checked = now[control.key] === radio.value;
      hold(element, buttons, locked, why || control.help);
    },
  };
}

function makeSlider(control: SliderControl, set: (value: number) => void): Row {
  const element = make("label", "control slide");
  const range = make("input");
  range.type = "range";
  range.id = `set-${control.key}`;
  range.min = String(control.low);
  range.max = String(control.high);
  range.step = String(control.step);
  range.addEventListener("input", () => set(range.valueAsNumber));
  const output = make("output");
  output.htmlFor.add(range.id);
  element.append(make("span", "", control.label), range, output);
  return {
    control,
    element,
    show: (now, locked, why) => {
      const value = now[control.key] as number;
      if (range.valueAsNumber !== value) range.value = String(value);
      const text = valueText(control, value);
      setText(output, text);
      range.setAttribute("aria-valuetext", text);
      hold(element, [range], locked, why || control.help);
    },
  };
}

/** Returns a slider's value as people read it: shares in per cent, all else with its unit. */
export function valueText(control: Pick<SliderControl, "unit" | "step" | "high" | "key">, value: number): string {
  if (control.unit === "") return `${Math.round((100 * value) / control.high)} %`;
  const decimals = control.step < 1 ? 1 : 0;
  const number = value.toFixed(decimals).replace("-", "−");
  return control.unit === "°" ? `${number}°` : `${control.unit === "dB" && value > 0 ? "+" : ""}${number} ${control.unit}`;
}

function hold(element: HTMLElement, inputs: readonly HTMLInputElement[], locked: boolean, title: string): void {
  element.title = title;
  element.dataset["locked"] = String(locked);
  for (const input of inputs) input.disabled = locked;
}
