/** The page's frames around the flat pictures: an inset over the 3D view, or three pictures with the arms' controls. */

import { ARM_PRESETS, sameArm } from "../fluoro/arms";
import type { ArmAngles, SettingsStore } from "../stage/settings";
import { make, setText } from "../ui/dom";
import type { Slot } from "./desk";
import type { Plate } from "./plate";

const LIMITS = { laoDeg: 100, cranialDeg: 45 } as const;
const LEAST_SHARE = 0.2;
const LEAST_INSET_PX = 160;

/** A picture's frame: the slot is where the plate goes. */
interface Framed {
  readonly figure: HTMLElement;
  readonly slot: Slot;
}

export class Frames {
  readonly inset: Slot;
  readonly arms: readonly [Slot, Slot];
  readonly third: Slot;
  readonly slots: readonly Slot[];
  private readonly insetFigure: HTMLElement;
  private readonly flat = make("div", "flat");
  private readonly thirdTitle: HTMLElement;
  private readonly controls: readonly ArmControls[];

  constructor(private readonly host: HTMLElement, private readonly store: SettingsStore) {
    const inset = framed("inset", "");
    this.insetFigure = inset.figure;
    this.inset = inset.slot;
    inset.figure.append(grip(inset.figure, host));
    const [a, b, c] = [framed("arm", "X-ray A"), framed("arm", "X-ray B"), framed("third", "Ultrasound (ICE)")];
    this.arms = [a.slot, b.slot];
    this.third = c.slot;
    this.thirdTitle = c.figure.querySelector("b")!;
    this.controls = [new ArmControls(a.figure, store, 0), new ArmControls(b.figure, store, 1)];
    this.flat.append(a.figure, b.figure, c.figure, splitter(this.flat, "column"), splitter(this.flat, "row"));
    this.flat.hidden = true;
    inset.figure.hidden = true;
    host.append(inset.figure, this.flat);
    this.slots = [this.inset, ...this.arms, this.third];
  }

  /** Shows the frames of a mode. third: the third picture, or the inset's. */
  show(mode: "3d" | "2d" | "none", third: Plate | null): void {
    this.host.dataset["mode"] = mode === "2d" ? "2d" : "3d";
    document.body.dataset["picture"] = this.host.dataset["mode"];
    this.flat.hidden = mode !== "2d";
    this.insetFigure.hidden = mode !== "3d" || third === null;
    if (third !== null) this.insetFigure.style.setProperty("--ratio", (third.widthM / third.heightM).toFixed(4));
    setText(this.thirdTitle, third?.title ?? "No third picture");
    this.refresh();
  }

  /** Follows the arms' angles, and whether they are held fast. */
  refresh(): void {
    for (const each of this.controls) each.refresh();
    this.flat.dataset["locked"] = String(this.store.locked("arms"));
  }
}

/** Preset and sliders of one arm, below its picture. */
class ArmControls {
  private readonly select = make("select");
  private readonly lao = slider(LIMITS.laoDeg);
  private readonly cranial = slider(LIMITS.cranialDeg);

  constructor(figure: HTMLElement, private readonly store: SettingsStore, private readonly arm: 0 | 1) {
    const name = arm === 0 ? "A" : "B";
    this.select.append(...ARM_PRESETS.map((preset) => option(preset.name)), option("own angles", true));
    this.select.setAttribute("aria-label", `Preset of arm ${name}`);
    this.lao.setAttribute("aria-label", `Arm ${name}: RAO to LAO, degrees`);
    this.cranial.setAttribute("aria-label", `Arm ${name}: caudal to cranial, degrees`);
    this.lao.title = "RAO (left) to LAO (right). Dragging the picture turns the arm, too.";
    this.cranial.title = "Caudal (left) to cranial (right)";
    this.select.addEventListener("change", () => {
      const preset = ARM_PRESETS.find((each) => each.name === this.select.value);
      if (preset !== undefined) this.turn(preset.angles);
    });
    for (const each of [this.lao, this.cranial]) {
      each.addEventListener("input", () => this.turn({ laoDeg: Number(this.lao.value), cranialDeg: Number(this.cranial.value) }));
    }
    const row = make("div", "arm-controls");
    row.append(labelled("RAO", this.lao, "LAO"), labelled("CAU", this.cranial, "CRA"));
    figure.querySelector("figcaption")!.append(this.select);
    figure.append(row);
    this.refresh();
  }

  refresh(): void {
    const angles = this.store.value.arms[this.arm];
    const held = this.store.locked("arms");
    this.select.value = ARM_PRESETS.find((each) => sameArm(each.angles, angles))?.name ?? "own angles";
    this.lao.value = String(angles.laoDeg);
    this.cranial.value = String(angles.cranialDeg);
    for (const each of [this.select, this.lao, this.cranial]) each.disabled = held;
    this.select.title = held ? this.store.why("arms") : "Views that are used often";
  }

  private turn(angles: ArmAngles): void {
    setArm(this.store, this.arm, angles);
  }
}

/** Turns one of the two arms. */
export function setArm(store: SettingsStore, arm: 0 | 1, angles: ArmAngles): void {
  const [a, b] = store.value.arms;
  store.set({ arms: arm === 0 ? [angles, b] : [a, angles] });
}

function framed(kind: string, title: string): Framed {
  const figure = make("figure", `frame ${kind}`);
  const caption = make("figcaption");
  caption.append(make("b", "", title));
  const element = make("div", "hole");
  if (title !== "") figure.append(caption);
  figure.append(element);
  return { figure, slot: { element, plate: null } };
}

function option(text: string, hidden = false): HTMLOptionElement {
  const made = make("option", "", text);
  made.value = text;
  made.hidden = hidden;
  return made;
}

function slider(most: number): HTMLInputElement {
  const made = make("input");
  made.type = "range";
  made.min = String(-most);
  made.max = String(most);
  made.step = "1";
  return made;
}

function labelled(low: string, input: HTMLInputElement, high: string): HTMLElement {
  const row = make("span", "range");
  row.append(make("i", "", low), input, make("i", "", high));
  return row;
}

/** A bar between pictures that is dragged, or moved with the arrow keys. */
function splitter(flat: HTMLElement, along: "column" | "row"): HTMLElement {
  const bar = make("div", `splitter ${along}`);
  const name = along === "column" ? "--across" : "--down";
  let share = 0.5;
  const set = (next: number): void => {
    share = Math.min(1 - LEAST_SHARE, Math.max(LEAST_SHARE, next));
    flat.style.setProperty(name, String(share));
    bar.setAttribute("aria-valuenow", String(Math.round(100 * share)));
  };
  bar.tabIndex = 0;
  bar.setAttribute("role", "separator");
  bar.setAttribute("aria-orientation", along === "column" ? "vertical" : "horizontal");
  bar.setAttribute("aria-valuenow", "50");
  bar.setAttribute("aria-label", along === "column" ? "Width of the pictures" : "Height of the pictures");
  bar.addEventListener("pointerdown", (event) => bar.setPointerCapture(event.pointerId));
  bar.addEventListener("focus", () => (share = Number(getComputedStyle(flat).getPropertyValue(name)) || 0.5));
  bar.addEventListener("pointermove", (event) => {
    if (!bar.hasPointerCapture(event.pointerId)) return;
    const box = flat.getBoundingClientRect();
    set(along === "column" ? (event.clientX - box.left) / box.width : (event.clientY - box.top) / box.height);
  });
  bar.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.03, ArrowUp: -0.03, ArrowRight: 0.03, ArrowDown: 0.03 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    set(share + step);
  });
  bar.addEventListener("dblclick", () => flat.style.removeProperty(name));
  return bar;
}

/** The corner by which the inset is made larger or smaller. */
function grip(figure: HTMLElement, host: HTMLElement): HTMLElement {
  const corner = make("div", "grip");
  corner.title = "Drag to resize";
  corner.addEventListener("pointerdown", (event) => corner.setPointerCapture(event.pointerId));
  corner.addEventListener("pointermove", (event) => {
    if (!corner.hasPointerCapture(event.pointerId)) return;
    const right = figure.getBoundingClientRect().right;
    const most = host.clientWidth - 24;
    figure.style.width = `${Math.round(Math.min(most, Math.max(LEAST_INSET_PX, right - event.clientX)))}px`;
  });
  return corner;
}
