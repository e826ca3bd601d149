/** The fiducials being found: both pictures, the list, placing by hand. */

import type { MarkersState, Vector2 } from "../generated/messages";
import { byId, setText } from "../ui/dom";
import type { Answer } from "../link/commands";
import { toast } from "../ui/toasts";
import { nudged } from "./fit";
import { keyed } from "./keyed";
import { MarkerList } from "./marker_list";
import type { MarkerKey } from "./marker_model";
import { keyOf, MarkerModel } from "./marker_model";
import { MarkerPicture, ZOOM_STEP } from "./marker_picture";
import { Placer } from "./placer";
import { ResultPictures } from "./results";
import type { Call, View, ViewContext } from "./view";

/** The server's answer and its next state come one after the other: a taken place is shown until both are here. */
const SETTLE_MS = 300;

export class MarkersView implements View<MarkersState> {
  readonly model = new MarkerModel();
  private readonly area = byId("marker-shots");
  private readonly panel = byId("markers-panel");
  private readonly hint = byId("marker-hint");
  private readonly list: MarkerList;
  private readonly placer: Placer;
  private readonly results = new ResultPictures(byId("small-results"));
  private readonly pictures = new Map<string, MarkerPicture>();
  private operating = false;
  private linked = false;
  /** Found ones that were removed here: the server can bring them back. */
  private readonly removed = new Set<MarkerKey>();
  private stage = "";

  constructor(private readonly context: ViewContext) {
    this.list = new MarkerList(this.model, {
      onSelect: (key) => this.choose(key),
      onRemove: (key) => void this.remove(key),
      onRestore: (key) => void this.unplace(key),
    });
    this.placer = new Placer({
      ask: (name, args) => context.ask(name, args),
      onSettled: (key, answer) => this.settle(key, answer),
    });
    addEventListener("keydown", (event) => this.key(event));
  }

  title(): string {
    return "Fiducials on the crosses";
  }

  take(state: MarkersState): void {
    this.model.take(state);
    this.area.hidden = this.panel.hidden = false;
    for (const marker of state.markers) if (marker.pixel !== null) this.removed.delete(keyOf(marker));
    this.makePictures();
    const solved = state.stage === "done" && this.stage !== "done";
    this.stage = state.stage;
    this.results.show(state.pictures, solved);
    this.allow(this.operating, this.linked);
  }

  call(state: MarkersState): Call {
    const missing = state.markers.filter((marker) => marker.pixel === null).length;
    const word = {
      collecting: missing === 0 ? "All fiducials placed" : missing === 1 ? "One fiducial is missing" : `${missing} fiducials are missing`,
      solving: "Calculating",
      done: "Calculated",
      failed: "Not yet",
    }[state.stage];
    return { look: state.stage === "collecting" ? (missing === 0 ? "known" : "wanted") : state.stage, word };
  }

  allow(operating: boolean, linked: boolean): void {
    if (this.linked && !linked) this.model.releaseAll();
    this.operating = operating;
    this.linked = linked;
    for (const picture of this.pictures.values()) {
      picture.setOperating(operating);
      picture.live.setActive(linked && !document.hidden);
    }
    this.refresh();
  }

  tick(): void {
    // what is drawn changes with states and pointers only
  }

  hide(): void {
    for (const picture of this.pictures.values()) picture.live.close();
    this.pictures.clear();
    this.area.replaceChildren();
    this.area.hidden = this.panel.hidden = true;
    this.results.show([], false);
    this.model.state = null;
    this.model.selected = null;
    this.model.releaseAll();
  }

  shown(): Record<string, number> {
    return Object.fromEntries([...this.pictures].map(([camera, picture]) => [camera, picture.live.shownSeq]));
  }

  private makePictures(): void {
    keyed(this.area, this.model.cameras, (camera) => camera, (camera) => {
      const picture = new MarkerPicture(camera, this.context.picturesHz, this.model, {
        onSelect: (key) => this.select(key),
        onMove: (key, pixel) => {
          this.model.move(key, pixel);
          this.list.show(this.operating, this.removed);
        },
        onPlace: (key, pixel, exact) => this.place(key, pixel, exact, true),
      });
      this.pictures.set(camera, picture);
      picture.refresh();
      return picture.element;
    }, () => undefined);
    for (const [camera, picture] of this.pictures) {
      if (this.model.cameras.includes(camera)) continue;
      picture.live.close();
      this.pictures.delete(camera);
    }
  }

  private refresh(): void {
    this.list.show(this.operating, this.removed);
    for (const picture of this.pictures.values()) picture.refresh();
    const chosen = this.model.selected === null ? null : this.model.find(this.model.selected);
    setText(this.hint, hintFor(this.operating, chosen?.name ?? null, chosen?.camera ?? "", chosen?.pixel == null));
  }

  /** A marker was chosen in the list: one that has no place is looked for in its picture next. */
  private choose(key: MarkerKey): void {
    this.select(this.model.selected === key ? null : key);
    const marker = this.model.find(key);
    if (marker?.pixel === null) this.pictures.get(marker.camera)?.element.scrollIntoView({ block: "nearest" });
  }

  private select(key: MarkerKey | null): void {
    this.model.selected = key;
    this.refresh();
  }

  private place(key: MarkerKey, pixel: Vector2, exact: boolean, advance: boolean): void {
    const marker = this.model.find(key);
    if (marker === null || !this.operating) return;
    const isNew = this.model.state?.markers.find((each) => keyOf(each) === key)?.pixel === null;
    this.model.move(key, pixel);
    this.placer.place(key, { camera: marker.camera, marker: marker.name, pixel, exact });
    this.select((advance && isNew ? this.model.nextMissing(key) : null) ?? key);
  }

  /** The server's place, which may be the middle of the spot that was meant, is shown until its state has it. */
  private settle(key: MarkerKey, answer: Answer): void {
    const place = answer.done ? answer.result["pixel"] : null;
    if (isPixel(place)) this.model.move(key, place);
    const release = (): void => {
      if (this.placer.waits(key)) return; // it has been moved again
      this.model.release(key);
      this.refresh();
    };
    if (answer.done) setTimeout(release, SETTLE_MS);
    else {
      toast(answer.sentence, "bad");
      release();
    }
    this.refresh();
  }

  private async remove(key: MarkerKey): Promise<void> {
    const marker = this.model.find(key);
    if (marker === null || marker.pixel === null || !this.operating) return;
    this.placer.forget(key);
    this.model.release(key);
    if (await this.unplace(key) && marker.origin === "found") this.removed.add(key);
    this.refresh();
  }

  /** Takes a marker away, or brings back one that was found and taken away; returns whether the server did. */
  private async unplace(key: MarkerKey): Promise<boolean> {
    const marker = this.model.find(key);
    if (marker === null) return false;
    const answer = await this.context.ask("calibration_unplace", { camera: marker.camera, marker: marker.name });
    if (!answer.done) toast(answer.sentence, "bad");
    return answer.done;
  }

  private key(event: KeyboardEvent): void {
    if (this.area.hidden || event.ctrlKey || event.metaKey || event.altKey) return;
    const target = event.target as HTMLElement;
    if (target instanceof HTMLInputElement || document.querySelector("dialog[open]") !== null) return;
    if (this.stroke(event.key, event.shiftKey)) event.preventDefault();
  }

  /** Returns whether the key meant something. */
  private stroke(key: string, shift: boolean): boolean {
    const chosen = this.model.selected === null ? null : this.model.find(this.model.selected);
    if (key === "Escape") {
      for (const picture of this.pictures.values()) picture.cancel();
      this.select(null);
      return true;
    }
    const zoomed = chosen === null ? [...this.pictures.values()] : [this.pictures.get(chosen.camera)!];
    if (key === "0") zoomed.forEach((picture) => picture.whole());
    else if (key === "+" || key === "=") zoomed.forEach((picture) => picture.zoomBy(ZOOM_STEP));
    else if (key === "-") zoomed.forEach((picture) => picture.zoomBy(1 / ZOOM_STEP));
    else if (chosen === null || chosen.pixel === null || !this.operating) return false;
    else if (key === "Delete" || key === "Backspace") void this.remove(chosen.key);
    else {
      const pixel = nudged(chosen.pixel, key, shift, this.model.size(chosen.camera));
      if (pixel === null) return false;
      this.place(chosen.key, pixel, true, false);
    }
    return true;
  }
}

function isPixel(value: unknown): value is Vector2 {
  return Array.isArray(value) && value.length === 2 && value.every((each) => typeof each === "number");
}

/** Returns what to do next, in a sentence. */
function hintFor(operating: boolean, name: string | null, camera: string, missing: boolean): string {
  const arrows = "Arrows are residuals, enlarged: as long as a ring's radius is 0.05 px.";
  if (!operating) return arrows;
  if (name === null) return `Choose a marker here or in a picture to move it. ${arrows}`;
  if (missing) return `Now click the centre of ${name} in the ${camera} picture; the loupe shows where.`;
  return `Drag ${name}, or move it with the arrow keys. ${arrows}`;
}
