/** The list of the heart's parts: show, hide, and how far each is seen through. */

import type { HeartDescription, PartDescription } from "../generated/messages";
import { fixed } from "../maths/format";
import type { PartSettings, SettingsStore } from "../stage/settings";
import { byId, make, setText } from "./dom";

const KINDS: Record<string, string> = {
  placement: "Placement only, not registered.",
  rigid: "Registered to landmarks",
  similarity: "Registered to landmarks, scaled",
  affine: "Registered to landmarks, scaled and stretched",
};

interface Row {
  readonly name: string;
  readonly box: HTMLInputElement;
  readonly range: HTMLInputElement;
  readonly element: HTMLElement;
  readonly title: string;
}

export class PartList {
  private rows: Row[] = [];

  constructor(private readonly store: SettingsStore) {
    store.listen(() => this.refresh());
  }

  /** Lists the parts of a heart that was loaded. */
  show(heart: HeartDescription): void {
    this.rows = heart.parts.map((part) => this.makeRow(part));
    byId("parts").replaceChildren(...this.rows.map((row) => row.element));
    this.refresh();
    setText(byId("placement"), placementText(heart));
  }

  /** Says in place of the list why there is none. */
  explain(text: string): void {
    this.rows = [];
    byId("parts").replaceChildren(make("p", "faint", text));
    setText(byId("placement"), "");
  }

  /** Hides every part, or shows every part when all are hidden. */
  toggleAll(): void {
    const visible = !this.rows.some((row) => this.store.part(row.name).visible);
    const parts: Record<string, PartSettings> = { ...this.store.value.parts };
    for (const { name } of this.rows) parts[name] = { ...this.store.part(name), visible };
    this.store.set({ parts });
  }

  private refresh(): void {
    const locked = this.store.locked("parts");
    const why = this.store.why("parts");
    for (const { name, box, range, element, title } of this.rows) {
      const { visible, opacity } = this.store.part(name);
      box.checked = visible;
      if (range.valueAsNumber !== opacity) range.value = String(opacity);
      box.disabled = range.disabled = locked;
      element.dataset["locked"] = String(locked);
      element.title = why || title;
    }
  }

  private makeRow({ name, label, colour }: PartDescription): Row {
    const element = make("div", "part");
    const box = make("input");
    box.type = "checkbox";
    box.id = `part-${name}`;
    const swatch = make("span", "swatch");
    swatch.style.background = colour;
    const text = make("label", "", label);
    text.htmlFor = box.id;
    const range = make("input");
    range.type = "range";
    range.min = "0";
    range.max = "1";
    range.step = "0.02";
    range.setAttribute("aria-label", `Opacity of ${label}`);
    box.addEventListener("input", () => this.store.setPart(name, { visible: box.checked }));
    range.addEventListener("input", () => this.store.setPart(name, { opacity: range.valueAsNumber }));
    element.append(box, swatch, text, range);
    return { name, box, range, element, title: label };
  }
}

/** Returns how well the heart lies where it is drawn, in words. */
function placementText({ registration }: HeartDescription): string {
  const { kind, fre_mm, tre_mm, predicted_tre_mm: centre, worst_tre_mm: worst, date } = registration;
  let text = KINDS[kind] ?? kind;
  if (kind === "placement") return text;
  if (date != null) text += ` on ${date}`;
  // The FRE never comes first, nor alone: it is not the error elsewhere.
  const parts = [`held-out TRE ${fixed(tre_mm, 1)} mm`];
  if (centre != null) parts.unshift(`predicted TRE ${fixed(centre, 1)} mm`);
  if (worst != null) parts[0] += `, at worst ${fixed(worst, 1)} mm`;
  return `${text}: ${parts.join("; ")}; FRE ${fixed(fre_mm, 1)} mm.`;
}
