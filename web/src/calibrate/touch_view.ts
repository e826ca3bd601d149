/** A heart being registered: where the next landmark is, whether the tip rests, the list, what is odd. */

import type { HeartView, TouchedLandmark, TouchState } from "../generated/messages";
import { fixed, withUnits } from "../maths/format";
import { byId, make, setText } from "../ui/dom";
import { toast } from "../ui/toasts";
import { keyed } from "./keyed";
import { ResultPictures } from "./results";
import type { Call, View, ViewContext } from "./view";

const KINDS: readonly { kind: TouchState["kind"]; label: string }[] = [
  { kind: "rigid", label: "Rigid" }, { kind: "similarity", label: "Scaled" }, { kind: "affine", label: "Affine" },
];

/** What is put over a view: the landmark's key, or the tip; where, in per cent; and how it looks. */
export interface Spot {
  readonly key: string;
  readonly x: number;
  readonly y: number;
  readonly look: "now" | "touched" | "waiting" | "skipped" | "tip";
  readonly title: string;
}

/** Returns the spots over one view of the heart, the most important last, for they are drawn in order. */
export function spotsOf(state: TouchState, view: number): Spot[] {
  const spots: Spot[] = [];
  for (const each of state.landmarks) {
    const place = each.places[view];
    if (place === undefined || each.name === state.current) continue;
    spots.push({ key: each.name, x: 100 * place[0], y: 100 * place[1], look: each.status, title: each.label });
  }
  const now = state.landmarks.find((each) => each.name === state.current);
  const place = now?.places[view];
  if (now !== undefined && place !== undefined && state.stage === "collecting") {
    spots.push({ key: now.name, x: 100 * place[0], y: 100 * place[1], look: "now", title: now.label });
  }
  const tip = state.tip_places[view];
  if (tip !== undefined) spots.push({ key: " tip", x: 100 * tip[0], y: 100 * tip[1], look: "tip", title: "The tip, by the landmarks so far" });
  return spots;
}

/** Returns what the list says of a landmark. */
export function wordsOf(each: TouchedLandmark): string {
  if (each.status === "skipped") return "skipped";
  if (each.status === "waiting") return "";
  if (each.held_out_mm !== null) return `held out ${fixed(each.held_out_mm, 1)} mm`;
  return each.spread_mm === null ? "touched" : `touched, ±${fixed(each.spread_mm, 2)} mm`;
}

export class TouchView implements View<TouchState> {
  private readonly area = byId("touch");
  private readonly panel = byId("touch-panel");
  private readonly results = new ResultPictures(byId("touch-results"));
  private stage = "";
  private operating = false;
  private state: TouchState | null = null;

  constructor(private readonly context: ViewContext) {}

  title(state: TouchState): string {
    return state.is_simulated ? "Registration by touch: simulation" : "Registration by touch";
  }

  take(state: TouchState): void {
    this.state = state;
    this.area.hidden = this.panel.hidden = false;
    const done = state.stage === "done";
    byId("touch-guide").hidden = done;
    byId("touch-results").hidden = !done;
    this.results.show(state.pictures, done && this.stage !== "done");
    this.stage = state.stage;
    this.showViews(state);
    this.showRest(state);
    this.showList(state);
    this.showKinds(state);
    keyed(byId("touch-doubts"), state.doubts, (each) => each, () => make("li"), (item, each) => setText(item, withUnits(each)));
  }

  call(state: TouchState): Call {
    if (state.stage === "failed") return { look: "failed", word: "Not yet" };
    if (state.stage === "solving") return { look: "solving", word: "Working it out" };
    if (state.stage === "done") return state.is_grave ? { look: "wanted", word: "In doubt" } : { look: "done", word: "Registered" };
    if (state.current === null) return { look: "known", word: "All landmarks done" };
    if (!state.is_tracked) return { look: "searching", word: "The tip is not seen" };
    if (state.can_take) return { look: "captured", word: "At rest: take it" };
    const number = state.landmarks.findIndex((each) => each.name === state.current) + 1;
    return { look: state.rest_share > 0.3 ? "capturing" : "hold", word: `Landmark ${number} of ${state.landmarks.length}` };
  }

  allow(operating: boolean): void {
    this.operating = operating;
    if (this.state !== null) {
      this.showList(this.state);
      this.showKinds(this.state);
    }
  }

  tick(): void {
    // states come often enough
  }

  hide(): void {
    this.area.hidden = this.panel.hidden = true;
    this.results.show([], false);
    this.state = null;
  }

  shown(): Record<string, number> {
    return {};
  }

  private showViews(state: TouchState): void {
    keyed(byId("touch-views"), state.views, (each) => each.path, makeView, (figure, view) => {
      const index = state.views.indexOf(view);
      keyed(figure.querySelector<HTMLElement>(".spots")!, spotsOf(state, index), (spot) => spot.key, () => make("i"), (mark, spot) => {
        mark.dataset["look"] = spot.look;
        mark.style.left = `${spot.x.toFixed(2)}%`;
        mark.style.top = `${spot.y.toFixed(2)}%`;
        mark.title = spot.title;
      });
    });
  }

  private showRest(state: TouchState): void {
    const rest = byId("touch-rest");
    rest.hidden = state.current === null || state.stage !== "collecting";
    rest.dataset["ready"] = String(state.can_take);
    byId("touch-bar").style.width = `${(100 * state.rest_share).toFixed(0)}%`;
    setText(byId("touch-still"), state.is_tracked ? (state.rest_share >= 1 ? "At rest" : "Hold still") : state.trouble);
    setText(byId("touch-spread"), state.is_tracked && state.rest_spread_mm !== null ? `±${fixed(state.rest_spread_mm, 2)} mm` : "");
  }

  private showList(state: TouchState): void {
    keyed(byId("touch-list"), state.landmarks, (each) => each.name, (each) => {
      const item = make("li");
      const button = make("button", "choose");
      button.type = "button";
      button.append(make("i", "mark"), make("span", "name"), make("span", "what"));
      button.addEventListener("click", () => void this.send("registration_choose", { landmark: each.name }));
      item.append(button);
      return item;
    }, (item, each) => {
      const button = item.querySelector("button")!;
      const now = each.name === state.current && state.stage === "collecting";
      item.dataset["status"] = each.status;
      button.setAttribute("aria-pressed", String(now));
      button.disabled = !this.operating || state.stage === "solving";
      button.title = each.status === "touched" ? "Touch it again" : "Touch it now";
      setText(item.querySelector(".mark")!, each.status === "touched" ? "✓" : each.status === "skipped" ? "–" : now ? "▸" : "");
      setText(item.querySelector(".name")!, each.label);
      setText(item.querySelector(".what")!, wordsOf(each));
    });
  }

  private showKinds(state: TouchState): void {
    keyed(byId("touch-kinds"), KINDS, (each) => each.kind, (each) => {
      const button = make("button", "", each.label);
      button.type = "button";
      button.addEventListener("click", () => void this.send("registration_kind", { kind: each.kind }));
      return button;
    }, (button, each) => {
      button.setAttribute("aria-pressed", String(each.kind === state.kind));
      button.disabled = !this.operating || state.stage === "solving";
    });
  }

  private async send(name: string, args: Record<string, unknown>): Promise<void> {
    const answer = await this.context.ask(name, args);
    if (!answer.done) toast(answer.sentence, "bad");
  }
}

function makeView(view: HeartView): HTMLElement {
  const figure = make("figure", "heart-view");
  const image = make("img");
  image.src = new URL(view.path.replace(/^\//, ""), document.baseURI).href;
  image.alt = `The heart ${view.title}`;
  [image.width, image.height] = view.size_px;
  const frame = make("div", "frame");
  frame.style.aspectRatio = `${view.size_px[0]} / ${view.size_px[1]}`;
  frame.append(image, make("div", "spots"));
  figure.append(frame, make("figcaption", "", view.title));
  return figure;
}
