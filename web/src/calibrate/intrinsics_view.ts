/** A lens being measured: the live picture with the board's corners and the coverage map, and the views. */

import type { BoardView, IntrinsicsState } from "../generated/messages";
import { byId, make, setText } from "../ui/dom";
import { toast } from "../ui/toasts";
import { drawBoardOverlay } from "./board_overlay";
import { filled } from "./coverage";
import type { Look } from "./intrinsics_look";
import { CAPTURED_MS, CaptureWatch, lookOf, lookWords } from "./intrinsics_look";
import { keyed } from "./keyed";
import { LivePicture } from "./live_picture";
import { ResultPictures } from "./results";
import { Sound } from "./sound";
import type { Call, View, ViewContext } from "./view";

export class IntrinsicsView implements View<IntrinsicsState> {
  private readonly area = byId("lens");
  private readonly shot = byId("lens-shot");
  private readonly panels = [byId("progress"), byId("views-panel")];
  private readonly map = byId<HTMLButtonElement>("cells");
  private readonly sound = new Sound();
  private readonly watch = new CaptureWatch();
  private readonly pictures = new ResultPictures(byId("large-results"));
  private picture: LivePicture | null = null;
  private camera = "";
  private state: IntrinsicsState | null = null;
  private operating = false;
  private linked = false;
  private withMap = true;

  constructor(private readonly context: ViewContext) {
    this.map.addEventListener("click", () => {
      this.withMap = !this.withMap;
      this.map.setAttribute("aria-pressed", String(this.withMap));
      this.picture?.redraw();
    });
  }

  title(state: IntrinsicsState): string {
    return `Lens of the ${state.camera} camera`;
  }

  take(state: IntrinsicsState): void {
    const before = this.state;
    this.state = state;
    const picture = this.pictureOf(state.camera);
    picture.describe({ width: state.size_px[0], height: state.size_px[1] });
    picture.still = state.stage !== "collecting";
    picture.want(state.corners_seq);
    if (this.watch.take(state, performance.now())) {
      this.sound.capture();
      setTimeout(() => this.context.refresh(), CAPTURED_MS + 20);
    }
    for (const panel of this.panels) panel.hidden = false;
    byId("sound").hidden = this.map.hidden = state.stage !== "collecting";
    const finished = state.stage === "done" || state.stage === "failed";
    this.pictures.show(finished ? state.pictures : [], finished && before?.stage !== state.stage);
    this.area.hidden = finished && state.pictures.length > 0;
    this.showProgress(state);
    this.showViews(state.views);
    this.look();
    this.allow(this.operating, this.linked);
    picture.redraw();
  }

  call(state: IntrinsicsState): Call {
    const look = lookOf(state, this.watch.since(performance.now()));
    return { look, word: lookWords(look) };
  }

  allow(operating: boolean, linked: boolean): void {
    if (this.linked && !linked) {
      this.watch.forget();
      this.picture?.tell("no link");
    }
    this.operating = operating;
    this.linked = linked;
    this.picture?.setActive(linked && !document.hidden && !this.area.hidden);
    for (const button of byId("views").querySelectorAll("button")) button.disabled = !operating;
  }

  tick(): void {
    this.look();
  }

  hide(): void {
    this.picture?.close();
    this.picture = null;
    this.camera = "";
    this.state = null;
    this.area.hidden = this.map.hidden = byId("sound").hidden = true;
    for (const panel of this.panels) panel.hidden = true;
    this.pictures.show([], false);
  }

  shown(): Record<string, number> {
    return this.picture === null ? {} : { [this.camera]: this.picture.shownSeq };
  }

  private pictureOf(camera: string): LivePicture {
    if (this.picture !== null && this.camera === camera) return this.picture;
    this.picture?.close();
    this.camera = camera;
    const canvas = byId<HTMLCanvasElement>("lens-canvas");
    canvas.setAttribute("aria-label", `Live picture of the ${camera} camera with the board's corners`);
    this.picture = new LivePicture({
      camera, canvas, note: byId("lens-note"), picturesHz: this.context.picturesHz, full: false,
      overlay: (on) => {
        if (this.state !== null) drawBoardOverlay(on, this.state, this.shot.dataset["look"] as Look, this.withMap);
      },
    });
    return this.picture;
  }

  private look(): void {
    if (this.state === null) return;
    const { look } = this.call(this.state);
    if (this.shot.dataset["look"] === look) return;
    this.shot.dataset["look"] = look;
    this.picture?.redraw();
  }

  private showProgress({ kept, wanted, coverage }: IntrinsicsState): void {
    setText(byId("kept"), String(kept));
    setText(byId("wanted"), String(wanted));
    const share = Math.min(1, kept / Math.max(1, wanted));
    byId("progress-ring").setAttribute("stroke-dasharray", `${(100 * share).toFixed(1)} 100`);
    byId("progress").dataset["full"] = String(share >= 1);
    const { filled: done, of } = filled(coverage);
    setText(byId("covered"), `The board has been in ${done} of ${of} parts of the picture.`);
  }

  private showViews(views: readonly BoardView[]): void {
    byId("no-views").hidden = views.length > 0;
    const kept = views.filter((view) => view.kept).length;
    const rejected = views.length - kept;
    setText(byId("views-title"), rejected === 0 ? "Views" : `Views: ${kept} kept, ${rejected} rejected`);
    keyed(byId("views"), [...views].reverse(), (view) => view.name, (view) => {
      const row = make("li");
      const button = make("button", "quiet", "Discard");
      button.type = "button";
      button.disabled = !this.operating;
      button.setAttribute("aria-label", `Discard ${view.name}`);
      button.addEventListener("click", () => void this.discard(view.name, button));
      row.append(make("i", "mark"), make("span", "name"), make("span", "reason"), button);
      return row;
    }, (row, view) => {
      row.dataset["kept"] = String(view.kept);
      const mark = row.querySelector<HTMLElement>(".mark")!;
      setText(mark, view.kept ? "✓" : "✕");
      mark.setAttribute("role", "img");
      mark.setAttribute("aria-label", view.kept ? "kept" : "rejected");
      setText(row.querySelector(".name")!, view.name);
      setText(row.querySelector(".reason")!, view.reason);
      row.querySelector("button")!.hidden = !view.kept;
    });
  }

  private async discard(view: string, button: HTMLButtonElement): Promise<void> {
    button.disabled = true;
    const answer = await this.context.ask("calibration_discard", { view });
    button.disabled = !this.operating;
    if (!answer.done) toast(answer.sentence, "bad");
  }
}
