/** A camera's picture on a canvas, as sharp as the screen, with something drawn over it. */

import type { Picture } from "../pictures/poller";
import { PicturePoller } from "../pictures/poller";
import { setText } from "../ui/dom";
import type { Fit, Size, Zoom } from "./fit";
import { fitted, WHOLE } from "./fit";
import { Matcher } from "./matcher";

const MOST_PIXEL_RATIO = 2;
/** The server makes pictures in steps of this width. */
const WIDTH_STEP_PX = 160;
const LEAST_WIDTH_PX = 640; // also asked for before the canvas has its size

/** What an overlay draws on: the context is scaled to CSS pixels. */
export interface Canvas {
  readonly context: CanvasRenderingContext2D;
  readonly fit: Fit;
  readonly picture: Size;
  readonly canvas: Size;
  readonly bitmap: ImageBitmap | null;
  readonly seq: number;
}

export interface LivePictureOptions {
  readonly camera: string;
  readonly canvas: HTMLCanvasElement;
  readonly note: HTMLElement;
  readonly picturesHz: number;
  /** Ask for the camera's own pixels, however small the canvas is. */
  readonly full: boolean;
  overlay(canvas: Canvas): void;
}

export class LivePicture {
  zoom: Zoom = WHOLE;
  /** The picture is not meant to change: that no newer one comes is no trouble. */
  still = false;
  picture: Size = { width: 16, height: 9 };
  private size: Size = { width: 1, height: 1 };
  private readonly context: CanvasRenderingContext2D;
  private readonly poller: PicturePoller;
  private readonly matcher = new Matcher<Picture>((picture) => picture.bitmap.close());
  private readonly observer: ResizeObserver;
  private readonly onPixelRatio = (): void => this.resize();
  private drawing = 0;

  /** Throws Error when the browser gives no 2D canvas. */
  constructor(private readonly options: LivePictureOptions) {
    const context = options.canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("This browser gives no 2D canvas.");
    this.context = context;
    this.poller = new PicturePoller(options.camera, options.picturesHz, {
      onPicture: (picture) => {
        if (this.matcher.put(picture, performance.now())) this.redraw();
      },
      onTrouble: (phrase) => this.tell(this.still && this.shownSeq >= 0 && phrase === "no new pictures" ? "" : phrase),
    });
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(options.canvas);
    addEventListener("resize", this.onPixelRatio);
    this.tell("waiting for the picture");
  }

  /** Number of the picture that is shown; -1 before the first. */
  get shownSeq(): number {
    return this.matcher.shown?.seq ?? -1;
  }

  get fit(): Fit {
    return fitted(this.picture, this.size, this.zoom);
  }

  get canvasSize(): Size {
    return this.size;
  }

  /** Says how large the camera's own pictures are: what is drawn over them is in these pixels. */
  describe(picture: Size): void {
    if (picture.width === this.picture.width && picture.height === this.picture.height) return;
    this.picture = picture;
    this.options.canvas.style.setProperty("--ratio", String(picture.width / picture.height));
    this.resize();
  }

  /** Says in which picture something was looked for: it is shown with what was found in it. */
  want(seq: number): void {
    if (this.matcher.want(seq, performance.now())) this.redraw();
  }

  setActive(active: boolean): void {
    if (active) this.poller.start();
    else this.poller.stop();
  }

  /** Says over the picture why it is not the present one; empty: it is. */
  tell(phrase: string): void {
    setText(this.options.note, phrase);
    this.options.note.hidden = phrase === "";
  }

  redraw(): void {
    if (this.drawing !== 0) return;
    this.drawing = requestAnimationFrame(() => {
      this.drawing = 0;
      this.draw();
    });
  }

  close(): void {
    cancelAnimationFrame(this.drawing);
    this.poller.stop();
    this.observer.disconnect();
    removeEventListener("resize", this.onPixelRatio);
    this.matcher.clear();
  }

  private resize(): void {
    const { canvas } = this.options;
    const ratio = Math.min(MOST_PIXEL_RATIO, devicePixelRatio);
    this.size = { width: Math.max(1, canvas.clientWidth), height: Math.max(1, canvas.clientHeight) };
    canvas.width = Math.round(this.size.width * ratio);
    canvas.height = Math.round(this.size.height * ratio);
    const seen = this.options.full ? this.picture.width : this.size.width * ratio;
    this.poller.width = Math.max(LEAST_WIDTH_PX, Math.ceil(seen / WIDTH_STEP_PX) * WIDTH_STEP_PX);
    this.draw(); // at once: a canvas that is resized is empty
  }

  private draw(): void {
    const { context, size, picture } = this;
    const { canvas } = this.options;
    const bitmap = this.matcher.shown?.bitmap ?? null;
    const { fit } = this;
    context.setTransform(canvas.width / size.width, 0, 0, canvas.height / size.height, 0, 0);
    context.fillStyle = "#05080c";
    context.fillRect(0, 0, size.width, size.height);
    if (bitmap !== null) {
      context.imageSmoothingEnabled = fit.scale < 4; // seen that large, a pixel is a square
      context.drawImage(bitmap, fit.left, fit.top, picture.width * fit.scale, picture.height * fit.scale);
    }
    this.options.overlay({ context, fit, picture, canvas: size, bitmap, seq: this.shownSeq });
  }
}
