/** The two camera panels on the page: which of them ask for pictures, and which is enlarged. */

import type { SceneDescription } from "../generated/messages";
import type { TrackLog } from "../link/tracks";
import { CameraPanel } from "../pictures/panel";
import { setText } from "./dom";

interface Figure {
  readonly panel: CameraPanel;
  readonly element: HTMLElement;
  readonly button: HTMLButtonElement;
  readonly rate: Element;
}

export class Pictures {
  readonly panels: CameraPanel[];
  private readonly figures: Figure[];
  private linked = false;

  constructor(tracks: TrackLog, picturesHz: number) {
    this.figures = [...document.querySelectorAll<HTMLElement>(".camera")].map((element) => {
      const button = element.querySelector("button")!;
      const panel = new CameraPanel(
        element.dataset["camera"]!, button.querySelector("canvas")!, button.querySelector<HTMLElement>(".note")!, tracks, picturesHz,
      );
      button.addEventListener("click", () => this.enlarge(element.classList.contains("large") ? null : panel.camera));
      return { panel, element, button, rate: element.querySelector("[data-rate]")! };
    });
    this.panels = this.figures.map((figure) => figure.panel);
    document.addEventListener("visibilitychange", () => this.refresh());
    addEventListener("resize", () => this.refresh());
  }

  describe(scene: SceneDescription): void {
    for (const { panel, element } of this.figures) {
      const camera = scene.cameras.find((each) => each.name === panel.camera);
      panel.describe(camera);
      if (camera !== undefined) element.style.setProperty("--ratio", String(camera.size_px[0] / camera.size_px[1]));
    }
  }

  /** Says whether the server can be asked: opened again, it counts its pictures anew. */
  setLinked(linked: boolean): void {
    this.linked = false;
    this.refresh();
    this.linked = linked;
    if (!linked) for (const panel of this.panels) panel.tell("no link");
    this.refresh();
  }

  /** Asks only for pictures that somebody sees. */
  refresh(): void {
    for (const { panel, element } of this.figures) {
      const seen = element.offsetParent !== null || element.classList.contains("large"); // a fixed element has none
      panel.setActive(this.linked && !document.hidden && seen);
    }
  }

  /** Enlarges one camera's picture, or none; returns whether anything changed. */
  enlarge(camera: string | null): boolean {
    let changed = false;
    for (const { panel, element, button } of this.figures) {
      const large = panel.camera === camera;
      changed ||= element.classList.contains("large") !== large;
      element.classList.toggle("large", large);
      button.setAttribute("aria-expanded", String(large));
      panel.setLarge(large);
      if (large) button.focus();
    }
    this.refresh();
    return changed;
  }

  get enlarged(): string | null {
    return this.figures.find(({ element }) => element.classList.contains("large"))?.panel.camera ?? null;
  }

  update(nowMs: number): void {
    for (const panel of this.panels) panel.update(nowMs);
  }

  /** Writes the rates; returns the mean over both cameras, pictures a second. */
  showRates(nowS: number): number {
    let sum = 0;
    for (const { panel, rate } of this.figures) {
      const hz = panel.rate.rate(nowS);
      sum += hz;
      setText(rate, hz > 0 ? `${hz.toFixed(0)} /s` : "");
    }
    return sum / Math.max(1, this.figures.length);
  }
}
