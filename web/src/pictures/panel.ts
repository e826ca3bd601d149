/** One camera's picture with the reconstructed centreline of the same picture pair drawn over it. */

import type { CameraDescription, TrackMessage } from "../generated/messages";
import type { TrackLog } from "../link/tracks";
import { CameraModel } from "../maths/camera";
import { RateMeter } from "../maths/statistics";
import type { Picture } from "./poller";
import { PicturePoller } from "./poller";

/** How long a picture waits for its Track, and how old the shown one may get before the next is shown without. */
const PATIENCE_MS = 300;
const MAX_POINTS = 512;
const COLOURS = { tracked: "#4cc2ff", coasting: "#ffb454", lost: "#ff6b6b" } as const;

export class CameraPanel {
  readonly rate = new RateMeter();
  /** Number of the pair that is shown; -1 before the first. For tests. */
  shownSeq = -1;
  /** Whether the shown picture carries the curve of its own pair. For tests. */
  overlaid = false;
  private readonly poller: PicturePoller;
  private readonly context: CanvasRenderingContext2D;
  private readonly pixels = new Float64Array(2 * MAX_POINTS);
  private model: CameraModel | null = null;
  private waiting: Picture | null = null;
  private waitingSinceMs = 0;
  private shownAtMs = -Infinity;
  /** CSS pixels: lines are as wide on the screen whatever the picture's size. */
  private shownWidth = 320;

  constructor(
    readonly camera: string,
    private readonly canvas: HTMLCanvasElement,
    private readonly note: HTMLElement,
    private readonly tracks: TrackLog,
    picturesHz: number,
  ) {
    const context = canvas.getContext("2d", { alpha: false });
    if (context === null) throw new Error("This browser gives no 2D canvas.");
    this.context = context;
    this.poller = new PicturePoller(camera, picturesHz, {
      onPicture: (picture) => this.take(picture),
      onTrouble: (phrase) => this.tell(phrase),
    });
    if (picturesHz <= 0) this.tell("pictures are turned off");
    new ResizeObserver(() => (this.shownWidth = Math.max(1, canvas.clientWidth))).observe(canvas);
  }

  describe(description: CameraDescription | undefined): void {
    this.model = description === undefined ? null : new CameraModel(description);
    if (description !== undefined) this.canvas.style.aspectRatio = `${description.size_px[0]} / ${description.size_px[1]}`;
  }

  /** Asks for pictures, or stops asking while nobody sees them. */
  setActive(active: boolean): void {
    if (active) this.poller.start();
    else this.poller.stop();
  }

  /** Says over the picture, as a short phrase, why it is not the present one; empty: it is. */
  tell(phrase: string): void {
    if (this.note.textContent !== phrase) this.note.textContent = phrase;
    this.note.hidden = phrase === "";
  }

  /** Chooses between the small and the large picture. */
  setLarge(large: boolean): void {
    this.poller.width = large ? 1280 : 640;
  }

  /** Shows the waiting picture once its Track is there. Called once for each drawn frame. */
  update(nowMs: number): void {
    const picture = this.waiting;
    if (picture === null) return;
    const track = this.tracks.get(picture.seq);
    if (track === null) {
      const overtaken = (this.tracks.newest?.seq ?? -1) > picture.seq;
      if (!overtaken && nowMs - this.waitingSinceMs < PATIENCE_MS) return;
      if (nowMs - this.shownAtMs < PATIENCE_MS) { // its Track was skipped: the next picture will have one
        this.discard();
        return;
      }
    }
    this.waiting = null;
    this.draw(picture, track);
    picture.bitmap.close();
    this.shownAtMs = nowMs;
    this.rate.mark(nowMs / 1000);
  }

  private take(picture: Picture): void {
    this.discard();
    this.waiting = picture;
    this.waitingSinceMs = performance.now();
  }

  private discard(): void {
    this.waiting?.bitmap.close();
    this.waiting = null;
  }

  private draw(picture: Picture, track: TrackMessage | null): void {
    const { bitmap } = picture;
    if (this.canvas.width !== bitmap.width || this.canvas.height !== bitmap.height) {
      this.canvas.width = bitmap.width;
      this.canvas.height = bitmap.height;
    }
    this.context.drawImage(bitmap, 0, 0);
    this.shownSeq = picture.seq;
    this.overlaid = track !== null && this.drawCurve(track, bitmap.width);
  }

  /** Draws the projected centreline; returns whether there was one. */
  private drawCurve(track: TrackMessage, width: number): boolean {
    const count = this.projectAll(track);
    if (count === 0 || this.model === null) return false;
    const scale = width / this.model.width;
    const thin = (width / this.shownWidth) * Math.min(2, Math.max(1, this.shownWidth / 400));
    const { context } = this;
    context.lineJoin = context.lineCap = "round";
    this.trace(count, scale);
    context.strokeStyle = "rgba(4, 10, 16, 0.55)";
    context.lineWidth = 3.4 * thin;
    context.stroke();
    context.strokeStyle = COLOURS[track.status];
    context.lineWidth = 1.8 * thin;
    context.stroke();
    const x = (this.pixels[0]! + 0.5) * scale;
    const y = (this.pixels[1]! + 0.5) * scale;
    context.beginPath();
    context.arc(x, y, 5 * thin, 0, 2 * Math.PI);
    context.strokeStyle = "rgba(4, 10, 16, 0.55)";
    context.lineWidth = 3.4 * thin;
    context.stroke();
    context.strokeStyle = "#ffffff";
    context.lineWidth = 1.4 * thin;
    context.stroke();
    return true;
  }

  private projectAll(track: TrackMessage): number {
    if (track.points === null || this.model === null) return 0;
    const count = Math.min(track.points.length, MAX_POINTS);
    for (let i = 0; i < count; i++) {
      const point = track.points[i]!;
      if (!this.model.projectInto(this.pixels, 2 * i, point[0], point[1], point[2])) return i;
    }
    return count;
  }

  /** Lays the curve's path. The centre of the first pixel is (0, 0) in the camera and (0.5, 0.5) on the canvas. */
  private trace(count: number, scale: number): void {
    this.context.beginPath();
    for (let i = 0; i < count; i++) {
      const x = (this.pixels[2 * i]! + 0.5) * scale;
      const y = (this.pixels[2 * i + 1]! + 0.5) * scale;
      if (i === 0) this.context.moveTo(x, y);
      else this.context.lineTo(x, y);
    }
  }
}
