/** Small pieces of the training panel that several of its parts are made of. */

import { make, setText } from "../../ui/dom";

const SVG = "http://www.w3.org/2000/svg";

/** A button with words; `main`: what most people press. */
export function button(label: string, act: () => void, name = ""): HTMLButtonElement {
  const made = make("button", name, label);
  made.type = "button";
  made.addEventListener("click", act);
  return made;
}

/** Shows a text, or hides its element where there is none. */
export function say(element: HTMLElement, text: string): void {
  element.hidden = text === "";
  setText(element, text);
}

/** A labelled field in the panel's grid. */
export function field(label: string, control: HTMLElement, id: string): HTMLElement {
  const row = make("label", "training-field");
  control.id = id;
  row.htmlFor = id;
  row.append(make("span", "", label), control);
  return row;
}

/** An SVG element with attributes. */
export function svg<K extends keyof SVGElementTagNameMap>(tag: K, attributes: Readonly<Record<string, string>>): SVGElementTagNameMap[K] {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}

/** The ring that fills while one stays within a target. */
export class DwellRing {
  readonly element = svg("svg", { viewBox: "0 0 40 40", class: "dwell", role: "img" });
  private readonly arc = svg("circle", { cx: "20", cy: "20", r: "16", class: "arc", pathLength: "100", "stroke-dasharray": "0 100" });
  private shown = -1;

  constructor() {
    this.element.append(svg("circle", { cx: "20", cy: "20", r: "16", class: "rail" }), this.arc);
  }

  /** share: 0 to 1. */
  show(share: number): void {
    const percent = Math.round(100 * share);
    if (percent === this.shown) return;
    this.shown = percent;
    this.arc.setAttribute("stroke-dasharray", `${percent} 100`);
    this.element.setAttribute("aria-label", `Held for ${percent} % of the time`);
  }
}
