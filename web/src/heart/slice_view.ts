/** One plane on the page: its picture, its slider, its buttons. */

import type { Size, Zoom } from "../calibrate/fit";
import { panned, WHOLE, zoomed } from "../calibrate/fit";
import type { SlicePlane, Vector2, Vector3 } from "../generated/messages";
import { make, setText } from "../ui/dom";
import type { Contours } from "./contours";
import { contoursOf } from "./contours";
import { drawContours, drawCrosshair, drawLetters, drawScale, drawSeeds, PLANE_COLOURS } from "./drawing";
import type { Placed, PlaneName } from "./geometry";
import { AXES, inPlane, isInside, placed, sizeMm, toCanvas, toSlice, withPlane, zoomOn } from "./geometry";
import type { SliceLoader } from "./loader";
import type { SeedsModel } from "./model";
import { paintCt, paintLabels } from "./paint";

const MOST_PIXEL_RATIO = 2;
export const ZOOM_STEP = 1.5;

/** A slice's pixels at one pixel a voxel, drawn enlarged. */
interface Sheet {
  readonly canvas: HTMLCanvasElement;
  readonly context: CanvasRenderingContext2D;
  image: ImageData;
  words: Uint32Array<ArrayBuffer>;
  made: unknown[];
}

interface Pair {
  readonly hu: Int16Array;
  readonly labels: Uint8Array | null;
}

export class SliceView {
  readonly element = make("figure", "slice");
  readonly canvas = make("canvas");
  zoom: Zoom = WHOLE;
  size: Size = { width: 1, height: 1 };
  /** Index of the slice whose picture is shown; -1 before the first. */
  shown = -1;
  /** Version of the labels that are shown with it; 0: none. */
  shownLabels = 0;
  private readonly note = make("span", "note");
  private readonly caption = make("b");
  private readonly slider = make("input");
  private readonly context: CanvasRenderingContext2D;
  private readonly back = sheet();
  private backed: unknown[] = [];
  private readonly ct = sheet();
  private readonly labels = sheet();
  private contours: { of: Uint8Array; found: Contours } | null = null;
  private drawing = 0;
  private trouble = "";
  private pair: Pair | null = null;

  /** Throws Error when the browser gives no 2D canvas. */
  constructor(
    readonly name: PlaneName,
    private readonly model: SeedsModel,
    private readonly loaders: { readonly ct: SliceLoader<Int16Array>; readonly labels: SliceLoader<Uint8Array> },
    onLarge: () => void,
  ) {
    const context = this.canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("This browser gives no 2D canvas.");
    this.context = context;
    this.element.dataset["plane"] = name;
    this.element.style.setProperty("--plane", PLANE_COLOURS[name]);
    this.canvas.tabIndex = 0;
    this.canvas.dataset["plane"] = name;
    this.canvas.setAttribute("role", "application");
    this.canvas.setAttribute("aria-label", `${capital(name)} slices: arrow keys move the cursor, page keys the slice, Enter places a seed`);
    this.slider.type = "range";
    this.slider.setAttribute("aria-label", `${capital(name)} slice`);
    this.slider.addEventListener("input", () => this.goTo(this.slider.valueAsNumber));
    const foot = make("figcaption");
    foot.append(this.caption, this.slider, this.buttons(onLarge));
    this.element.append(this.canvas, this.note, foot);
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    addEventListener("resize", () => this.resize());
  }

  /** Shows what the model says, with the next frame. */
  refresh(): void {
    if (this.drawing === 0) {
      this.drawing = requestAnimationFrame(() => {
        this.drawing = 0;
        this.draw();
      });
    }
  }

  /** Says why there is no picture, or not the wanted one; empty: there is. */
  tell(phrase: string): void {
    this.trouble = phrase;
    this.refresh();
  }

  get placed(): Placed | null {
    const plane = this.model.plane(this.name);
    return plane === null ? null : placed(plane, this.size, this.zoom);
  }

  /** Returns the seen coordinates under a place of the canvas; null outside the slice. */
  seenAt(at: Vector2): Vector3 | null {
    const plane = this.model.plane(this.name);
    if (plane === null) return null;
    const where = toSlice(placed(plane, this.size, this.zoom), at);
    if (!isInside(where, plane)) return null;
    const seen: [number, number, number] = [...withPlane(this.name, this.model.cursor, where)];
    seen[AXES[this.name][2]] = this.model.slice(this.name);
    return seen;
  }

  /** Returns where seen coordinates are on the page, CSS pixels. */
  onPage(seen: Vector3): [number, number] {
    const box = this.canvas.getBoundingClientRect();
    const where = this.placed;
    if (where === null) return [box.left, box.top];
    const [x, y] = toCanvas(where, inPlane(this.name, seen));
    return [box.left + x, box.top + y];
  }

  goTo(slice: number): void {
    const axis = AXES[this.name][2];
    const cursor: [number, number, number] = [...this.model.cursor];
    cursor[axis] = slice;
    this.model.look(cursor);
  }

  zoomBy(factor: number, at?: Vector2): void {
    const plane = this.model.plane(this.name);
    const spot = this.placed;
    if (plane === null || spot === null) return;
    const [column, row] = inPlane(this.name, this.model.cursor);
    const towards: Vector2 = at ?? [spot.left + (column + 0.5) * spot.perColumn, spot.top + (row + 0.5) * spot.perRow];
    this.zoom = zoomed(this.zoom, factor, towards, sizeMm(plane), this.size);
    this.refresh();
  }

  panBy(step: Vector2): void {
    const plane = this.model.plane(this.name);
    if (plane === null) return;
    this.zoom = panned(this.zoom, step, sizeMm(plane), this.size);
    this.refresh();
  }

  /** Shows what lies between two seen voxels as large as it goes. */
  zoomOn(low: Vector3, high: Vector3): void {
    const plane = this.model.plane(this.name);
    if (plane === null) return;
    this.zoom = zoomOn(plane, this.size, low, high);
    this.refresh();
  }

  whole(): void {
    this.zoom = WHOLE;
    this.refresh();
  }

  /** Returns the Hounsfield units and the label at seen coordinates of this plane's slice; null where not loaded. */
  valuesAt(seen: Vector3): { hu: number | null; label: number } {
    const plane = this.model.plane(this.name);
    if (plane === null) return { hu: null, label: 0 };
    const index = this.model.slice(this.name);
    const [column, row] = inPlane(this.name, seen).map((each) => Math.floor(each + 0.5)) as [number, number];
    const at = row * plane.columns + column;
    const hu = this.loaders.ct.want(this.name, index, plane.slices)?.[at] ?? null;
    const labels = this.model.state?.labels_version ? this.loaders.labels.want(this.name, index, plane.slices) : null;
    return { hu, label: labels?.[at] ?? 0 };
  }

  private buttons(onLarge: () => void): HTMLElement {
    const group = make("div", "zooms");
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", `Size of the ${this.name} slices`);
    for (const [words, label, act] of [
      ["−", "Make smaller", () => this.zoomBy(1 / ZOOM_STEP)],
      ["+", "Enlarge about the cursor", () => this.zoomBy(ZOOM_STEP)],
      ["Fit", "Whole slice", () => this.whole()],
      ["⤢", "Make this view the large one", onLarge],
    ] as const) {
      const button = make("button", words === "⤢" ? "grow" : "", words);
      button.type = "button";
      button.title = label;
      button.setAttribute("aria-label", `${label}: ${this.name}`);
      button.addEventListener("click", act);
      group.append(button);
    }
    return group;
  }

  private resize(): void {
    const ratio = Math.min(MOST_PIXEL_RATIO, devicePixelRatio);
    this.size = { width: Math.max(1, this.canvas.clientWidth), height: Math.max(1, this.canvas.clientHeight) };
    this.canvas.width = Math.round(this.size.width * ratio);
    this.canvas.height = Math.round(this.size.height * ratio);
    this.draw(); // at once: a canvas that is resized is empty
  }

  private draw(): void {
    const { context, size, model, canvas } = this;
    context.setTransform(canvas.width / size.width, 0, 0, canvas.height / size.height, 0, 0);
    context.fillStyle = "#05080c";
    context.fillRect(0, 0, size.width, size.height);
    const plane = model.plane(this.name);
    const where = this.placed;
    this.showFoot();
    if (plane === null || where === null || model.state === null) return;
    const index = model.slice(this.name);
    const pair = this.load(plane, index);
    if (pair === null) return;
    // What the cursor does not change is kept: it moves more often than all else.
    const from = [pair, model.greyTable, model.labelTable, model.overlay, model.opacity, this.zoom, canvas.width, canvas.height];
    if (from.some((each, at) => each !== this.backed[at])) {
      this.backed = from;
      this.drawScan(plane, where, pair);
    }
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.drawImage(this.back.canvas, 0, 0);
    context.setTransform(canvas.width / size.width, 0, 0, canvas.height / size.height, 0, 0);
    drawCrosshair(context, where, this.name, model, size);
    drawSeeds(context, where, this.name, model);
    drawLetters(context, plane, size);
    drawScale(context, where, size);
  }

  /** Draws the slice and its labels into the background. */
  private drawScan(plane: SlicePlane, where: Placed, pair: Pair): void {
    const { model, size } = this;
    const { canvas, context } = this.back;
    const { columns, rows } = plane;
    if (canvas.width !== this.canvas.width) canvas.width = this.canvas.width;
    if (canvas.height !== this.canvas.height) canvas.height = this.canvas.height;
    context.setTransform(canvas.width / size.width, 0, 0, canvas.height / size.height, 0, 0);
    context.fillStyle = "#05080c";
    context.fillRect(0, 0, size.width, size.height);
    const { hu, labels } = pair;
    this.paint(this.ct, columns, rows, [hu, model.greyTable], (words) => paintCt(hu, model.greyTable, words));
    const [width, height] = [columns * where.perColumn, rows * where.perRow];
    context.imageSmoothingEnabled = where.fit.scale * Math.max(...plane.spacing_mm.slice(0, 2)) < 12; // then a voxel is seen as one
    context.drawImage(this.ct.canvas, where.left, where.top, width, height);
    if (labels !== null && model.overlay !== "off") {
      if (model.overlay === "fill") {
        this.paint(this.labels, columns, rows, [labels, model.labelTable], (words) => paintLabels(labels, model.labelTable, words));
        context.globalAlpha = model.opacity;
        context.drawImage(this.labels.canvas, where.left, where.top, width, height);
        context.globalAlpha = 1;
      }
      if (this.contours?.of !== labels) this.contours = { of: labels, found: contoursOf(labels, columns, rows) };
      const strength = model.overlay === "outline" ? Math.max(0.25, Math.min(1, model.opacity * 2)) : Math.min(1, model.opacity * 1.6);
      drawContours(context, where, this.contours.found, model.visible(), strength);
    }
  }

  /** Returns the slice with its labels; the one before until both have come, so that nothing flickers. */
  private load(plane: SlicePlane, index: number): Pair | null {
    const { model } = this;
    const hu = this.loaders.ct.want(this.name, index, plane.slices);
    const labelled = (model.state?.labels_version ?? 0) > 0;
    const labels = labelled ? this.loaders.labels.want(this.name, index, plane.slices) : null;
    if (hu !== null && (hu !== this.pair?.hu || labels !== this.pair.labels) && (labels !== null || !labelled || model.overlay === "off" || this.pair === null)) {
      this.pair = { hu, labels };
      this.shown = index;
      this.shownLabels = labels === null ? 0 : model.state?.labels_version ?? 0;
    }
    return this.pair;
  }

  private showFoot(): void {
    const plane = this.model.plane(this.name);
    const index = this.model.slice(this.name);
    setText(this.caption, plane === null ? capital(this.name) : `${capital(this.name)} ${index + 1} / ${plane.slices}`);
    this.slider.max = String((plane?.slices ?? 1) - 1);
    this.slider.value = String(index);
    this.slider.disabled = plane === null;
    const phrase = this.trouble !== "" ? this.trouble : this.shown < 0 ? "waiting for the scan" : "";
    setText(this.note, phrase);
    this.note.hidden = phrase === "";
  }

  /** Makes a sheet's pixels anew where what they are made from has changed. */
  private paint(on: Sheet, columns: number, rows: number, from: unknown[], write: (words: Uint32Array) => void): void {
    if (on.canvas.width !== columns || on.canvas.height !== rows) {
      on.canvas.width = columns;
      on.canvas.height = rows;
      on.image = on.context.createImageData(columns, rows);
      on.words = new Uint32Array(on.image.data.buffer);
      on.made = [];
    }
    if (from.every((each, at) => each === on.made[at])) return;
    on.made = from;
    write(on.words);
    on.context.putImageData(on.image, 0, 0);
  }
}

function sheet(): Sheet {
  const canvas = make("canvas");
  canvas.width = canvas.height = 1;
  const context = canvas.getContext("2d");
  if (context === null) throw new Error("This browser gives no 2D canvas.");
  const image = context.createImageData(1, 1);
  return { canvas, context, image, words: new Uint32Array(image.data.buffer), made: [] };
}

export function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
