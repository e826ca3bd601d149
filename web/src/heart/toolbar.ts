/** The row over the slices: what dragging does, the window, how the labels are shown. */

import { byId, setText } from "../ui/dom";
import type { Overlay, SeedsModel, Tool } from "./model";
import { PRESETS } from "./paint";

const OVERLAYS: readonly Overlay[] = ["fill", "outline", "off"];
const OWN = "own";

export class Toolbar {
  private readonly window = byId<HTMLSelectElement>("window");
  private readonly opacity = byId<HTMLInputElement>("opacity");

  constructor(private readonly model: SeedsModel) {
    this.window.append(...PRESETS.map((preset) => new Option(preset.name, preset.key)), new Option("by hand", OWN));
    this.window.addEventListener("change", () => {
      const preset = PRESETS.find((each) => each.key === this.window.value);
      if (preset !== undefined) model.window = preset.window;
      else this.refresh();
    });
    this.opacity.addEventListener("input", () => {
      model.opacity = this.opacity.valueAsNumber;
      if (model.overlay === "off") model.overlay = "fill";
      model.change();
    });
    for (const button of byId("tool").querySelectorAll("button")) {
      button.addEventListener("click", () => {
        model.tool = button.dataset["tool"] as Tool;
        model.change();
      });
    }
    for (const button of byId("overlay").querySelectorAll("button")) {
      button.addEventListener("click", () => {
        model.overlay = button.dataset["overlay"] as Overlay;
        model.change();
      });
    }
    this.refresh();
  }

  nextWindow(): void {
    const now = PRESETS.findIndex((each) => each.window === this.model.window);
    this.model.window = PRESETS[(now + 1) % PRESETS.length]!.window;
  }

  nextOverlay(): void {
    this.model.overlay = OVERLAYS[(OVERLAYS.indexOf(this.model.overlay) + 1) % OVERLAYS.length]!;
    this.model.change();
  }

  refresh(): void {
    const { model } = this;
    const { centre, width } = model.window;
    this.window.value = PRESETS.find((each) => each.window === model.window)?.key ?? OWN;
    setText(byId("window-values"), `${centre} ± ${Math.round(width / 2)} HU`.replace("-", "−"));
    for (const button of byId("tool").querySelectorAll("button")) {
      button.setAttribute("aria-pressed", String(button.dataset["tool"] === model.tool));
    }
    for (const button of byId("overlay").querySelectorAll("button")) {
      button.setAttribute("aria-pressed", String(button.dataset["overlay"] === model.overlay));
    }
    this.opacity.value = String(model.opacity);
    document.body.dataset["tool"] = model.tool;
  }
}
