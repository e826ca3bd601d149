/** The list of fiducials beside the pictures: what each one's state is, and which one is being worked on. */

import { byId, make, setText } from "../ui/dom";
import { ringColour } from "./colours";
import { keyed } from "./keyed";
import type { MarkerKey, MarkerModel, ShownMarker } from "./marker_model";

export interface MarkerListHandlers {
  onSelect(key: MarkerKey): void;
  onRemove(key: MarkerKey): void;
  /** Bring one back that was found and removed. */
  onRestore(key: MarkerKey): void;
}

export class MarkerList {
  private readonly host = byId("marker-lists");

  constructor(private readonly model: MarkerModel, private readonly handlers: MarkerListHandlers) {}

  /** `removed`: those that can be brought back. */
  show(operating: boolean, removed: ReadonlySet<MarkerKey>): void {
    keyed(this.host, this.model.cameras, (camera) => camera, (camera) => {
      const group = make("section", "marker-group");
      const list = make("ul");
      list.setAttribute("aria-label", `Fiducials of the ${camera} camera`);
      group.append(make("h3", "", `${camera} camera`), list);
      return group;
    }, (group, camera) => this.fill(group.querySelector("ul")!, this.model.of(camera), operating, removed));
  }

  private fill(
    list: HTMLElement, markers: readonly ShownMarker[], operating: boolean, removed: ReadonlySet<MarkerKey>,
  ): void {
    keyed(list, markers, (marker) => marker.key, (marker) => {
      const row = make("li");
      const choose = make("button", "choose");
      choose.type = "button";
      const swatch = make("i", "swatch");
      swatch.setAttribute("aria-hidden", "true");
      choose.append(swatch, make("span", "name", marker.name), make("span", "what"));
      choose.addEventListener("click", () => this.handlers.onSelect(marker.key));
      const remove = make("button", "round quiet", "×");
      remove.type = "button";
      remove.addEventListener("click", () => {
        if (remove.dataset["restores"] === "true") this.handlers.onRestore(marker.key);
        else this.handlers.onRemove(marker.key);
      });
      row.append(choose, remove);
      return row;
    }, (row, marker) => {
      row.dataset["origin"] = marker.origin;
      row.dataset["there"] = String(marker.pixel !== null);
      row.querySelector<HTMLElement>(".swatch")!.style.backgroundColor = ringColour(marker.colour);
      setText(row.querySelector(".what")!, wordsFor(marker));
      const choose = row.querySelector<HTMLButtonElement>(".choose")!;
      choose.setAttribute("aria-pressed", String(marker.key === this.model.selected));
      const remove = row.querySelector<HTMLButtonElement>(".round")!;
      const restores = marker.pixel === null && removed.has(marker.key);
      remove.dataset["restores"] = String(restores);
      setText(remove, restores ? "↺" : "×");
      remove.title = restores ? `Take ${marker.name} where it was found` : `Remove ${marker.name}`;
      remove.setAttribute("aria-label", `${remove.title} in the ${marker.camera} picture`);
      remove.hidden = marker.pixel === null && !restores;
      remove.disabled = !operating;
    });
  }
}

/** Returns a marker's state in words: its residual where there is one. */
export function wordsFor(marker: ShownMarker): string {
  if (marker.moving) return "being placed";
  if (marker.pixel === null) return marker.origin === "ambiguous" ? "ambiguous: place it" : "missing: place it";
  const residual = marker.residual_px === null ? "" : `, ${marker.residual_px.toFixed(2)} px`;
  return `${marker.origin}${residual}`;
}
