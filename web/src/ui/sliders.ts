/** The twin's controls: sliders, and the manoeuvres that move it by themselves. */

import type { TwinDescription } from "../generated/messages";
import type { Control } from "../link/steering";
import { CONTROLS } from "../link/steering";
import { fixed } from "../maths/format";
import { byId, make } from "./dom";

interface Look {
  readonly label: string;
  readonly unit: string;
  readonly keys: readonly [string, string];
  readonly step: number;
}

const LOOKS: Record<Control, Look> = {
  insertion_mm: { label: "Insertion", unit: "mm", keys: ["S", "W"], step: 0.5 },
  roll_deg: { label: "Roll", unit: "°", keys: ["A", "D"], step: 1 },
  anterior_deg: { label: "Anterior +, posterior −", unit: "°", keys: ["↓", "↑"], step: 1 },
  left_deg: { label: "Left +, right −", unit: "°", keys: ["→", "←"], step: 1 },
};

export interface SliderHandlers {
  onControl(control: Control, value: number): void;
  onManoeuvre(name: string): void;
}

export class Sliders {
  private readonly inputs = new Map<Control, HTMLInputElement>();
  private readonly outputs = new Map<Control, HTMLOutputElement>();
  private readonly select = byId<HTMLSelectElement>("manoeuvre");
  private described = "";

  constructor(private readonly handlers: SliderHandlers) {
    this.select.addEventListener("change", () => {
      if (this.select.value !== "") this.handlers.onManoeuvre(this.select.value);
    });
  }

  /** Builds the controls for a twin; keeps them where they are when nothing has changed. */
  describe(twin: TwinDescription): void {
    const key = JSON.stringify(twin);
    if (key === this.described) return;
    this.described = key;
    this.inputs.clear();
    this.outputs.clear();
    byId("sliders").replaceChildren(...CONTROLS.map((control) => this.makeSlider(control, twin[control])));
    this.select.replaceChildren(new Option("as started", ""), ...twin.manoeuvres.map((name) => new Option(spoken(name), name)));
  }

  /** Says that nothing is known about what moves the twin: the server was started anew. */
  forget(): void {
    if (this.select.options.length > 0) this.select.options[0]!.text = "as started";
    this.showManoeuvre("");
  }

  get ready(): boolean {
    return this.inputs.size > 0;
  }

  value(control: Control): number {
    return this.inputs.get(control)?.valueAsNumber ?? 0;
  }

  /** Moves a control by an amount, within its range, as keys do. */
  nudge(control: Control, amount: number): void {
    const input = this.inputs.get(control);
    if (input === undefined) return;
    const wanted = Math.min(Number(input.max), Math.max(Number(input.min), input.valueAsNumber + amount));
    input.step = "any"; // a held key moves by less than a step in one frame
    input.value = String(wanted);
    this.changed(control);
  }

  /** Shows what the twin's controls are, without sending anything; a control that is being dragged is left alone. */
  show(values: Partial<Record<Control, number>>): void {
    for (const control of CONTROLS) {
      const value = values[control];
      const input = this.inputs.get(control);
      if (value === undefined || input === undefined || input.matches(":active")) continue;
      input.step = "any";
      input.value = String(value);
      this.write(control);
    }
  }

  /** Shows which manoeuvre runs; an empty name: steered by hand. */
  showManoeuvre(name: string): void {
    if (this.select.value !== name) this.select.value = name;
  }

  private makeSlider(control: Control, [low, high]: readonly [number, number]): HTMLElement {
    const look = LOOKS[control];
    const host = make("div", "slider");
    const head = make("div", "head");
    const label = make("label", "", look.label);
    const output = make("output");
    const input = make("input");
    input.type = "range";
    input.id = `slider-${control}`;
    label.htmlFor = input.id;
    output.htmlFor.add(input.id);
    input.min = String(low);
    input.max = String(high);
    input.step = String(look.step);
    input.value = String(Math.min(high, Math.max(low, control === "insertion_mm" ? (low + high) / 2 : 0)));
    input.title = `Keys ${look.keys.join(" and ")}`;
    input.addEventListener("input", () => {
      input.step = String(look.step);
      this.changed(control);
    });
    for (const key of look.keys) label.append(make("kbd", "", key));
    head.append(label, output);
    host.append(head, input);
    this.inputs.set(control, input);
    this.outputs.set(control, output);
    this.write(control);
    return host;
  }

  private changed(control: Control): void {
    this.write(control);
    this.select.options[0]!.text = "steered by hand";
    this.showManoeuvre("");
    this.handlers.onControl(control, this.value(control));
  }

  private write(control: Control): void {
    const unit = LOOKS[control].unit;
    const text = fixed(this.value(control), control === "insertion_mm" ? 1 : 0) + (unit === "°" ? unit : ` ${unit}`);
    this.outputs.get(control)!.textContent = text;
    this.inputs.get(control)!.setAttribute("aria-valuetext", text);
  }
}

function spoken(name: string): string {
  return name.replaceAll("_", " ");
}
