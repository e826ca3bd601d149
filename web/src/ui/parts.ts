/** The list of the heart's parts: show, hide, and how far each is seen through. */

import type { HeartDescription } from "../generated/messages";
import type { HeartPart } from "../scene/heart";
import { DEFAULT_OPACITY } from "../scene/heart";
import { fixed } from "../maths/format";
import { byId, make, setText } from "./dom";

const KINDS: Record<string, string> = {
  placement: "Placement only, not registered.",
  rigid: "Registered to landmarks",
  similarity: "Registered to landmarks, scaled",
  affine: "Registered to landmarks, scaled and stretched",
};

export class PartList {
  private rows: { part: HeartPart; box: HTMLInputElement; range: HTMLInputElement }[] = [];
  private readonly all = byId<HTMLInputElement>("all-opacity");

  constructor(private readonly onChange: () => void) {
    this.all.addEventListener("input", () => {
      for (const row of this.rows) row.range.value = this.all.value;
      this.apply();
    });
  }

  /** Lists the parts of a heart that was loaded. */
  show(parts: readonly HeartPart[], heart: HeartDescription): void {
    this.rows = parts.map((part) => this.makeRow(part));
    byId("parts").replaceChildren(...this.rows.map((row) => row.box.parentElement!));
    byId("all-parts").hidden = parts.length === 0;
    this.all.value = String(parts[0]?.opacity ?? DEFAULT_OPACITY);
    const { kind, fre_mm, tre_mm, predicted_tre_mm: centre, worst_tre_mm: worst, date } = heart.registration;
    let text = KINDS[kind] ?? kind;
    if (kind !== "placement") {
      if (date != null) text += ` on ${date}`;
      // The FRE never comes first, nor alone: it is not the error elsewhere.
      const parts = [`held-out TRE ${fixed(tre_mm, 1)} mm`];
      if (centre != null) parts.unshift(`predicted TRE ${fixed(centre, 1)} mm`);
      if (worst != null) parts[0] += `, at worst ${fixed(worst, 1)} mm`;
      text += `: ${parts.join("; ")}; FRE ${fixed(fre_mm, 1)} mm.`;
    }
    setText(byId("placement"), text);
  }

  /** Says in place of the list why there is none. */
  explain(text: string): void {
    this.rows = [];
    byId("parts").replaceChildren(make("p", "faint", text));
    byId("all-parts").hidden = true;
    setText(byId("placement"), "");
  }

  /** Hides every part, or shows every part when all are hidden. */
  toggleAll(): void {
    const visible = !this.rows.some((row) => row.box.checked);
    for (const row of this.rows) row.box.checked = visible;
    this.apply();
  }

  private apply(): void {
    for (const { part, box, range } of this.rows) part.show(box.checked, range.valueAsNumber);
    this.onChange();
  }

  private makeRow(part: HeartPart): { part: HeartPart; box: HTMLInputElement; range: HTMLInputElement } {
    const { name, label, colour } = part.description;
    const row = make("div", "part");
    const box = make("input");
    box.type = "checkbox";
    box.id = `part-${name}`;
    box.checked = part.visible;
    const swatch = make("span", "swatch");
    swatch.style.background = colour;
    const text = make("label", "", label);
    text.htmlFor = box.id;
    text.title = label;
    const range = make("input");
    range.type = "range";
    range.min = "0";
    range.max = "1";
    range.step = "0.02";
    range.value = String(part.opacity);
    range.setAttribute("aria-label", `Opacity of ${label}`);
    for (const control of [box, range]) control.addEventListener("input", () => this.apply());
    row.append(box, swatch, text, range);
    return { part, box, range };
  }
}
