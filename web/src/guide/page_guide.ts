/** The guide on the page: a card on the picture, a ring about what is meant, and a line between the two. */

import type { Stage } from "../stage/stage";
import { make, setText } from "../ui/dom";
import type { Place } from "./anchor";
import { AnchorFinder } from "./anchor";
import type { Guide } from "./guide";
import type { Step } from "./steps";
import { wordsOf } from "./steps";

const SVG = "http://www.w3.org/2000/svg";
/** Less than this the ring need not be moved. */
const SEEN_PX = 0.5;
const CORNER_PX = 26;

export class PageGuide {
  private readonly card = make("section", "guide");
  private readonly count = make("p", "guide-count");
  private readonly title = make("h2", "guide-title");
  private readonly text = make("p", "guide-text");
  private readonly meter = make("div", "guide-meter");
  private readonly bar = make("progress");
  private readonly figure = make("span", "guide-figure");
  private readonly praise = make("p", "guide-praise");
  private readonly live = make("p", "guide-live");
  private readonly backButton = button("Back", "guide-back", () => this.guide.back());
  private readonly skipButton = button("Skip the guide", "guide-skip", () => void this.guide.skip());
  private readonly nextButton = button("Next", "guide-next", () => this.guide.next());
  private readonly overlay = document.createElementNS(SVG, "svg");
  private readonly line = document.createElementNS(SVG, "line");
  private readonly ring = make("div", "guide-ring");
  private readonly finder: AnchorFinder;
  private readonly drawn: Place = { x: NaN, y: NaN, w: NaN, h: NaN, round: false, shown: false };
  private version = -1;
  private step: Step | null = null;
  private said = "";

  constructor(private readonly guide: Guide, stage: Stage) {
    this.finder = new AnchorFinder(stage);
    this.build();
    this.card.hidden = true;
    document.querySelector("main")!.append(this.card);
    this.overlay.classList.add("guide-line");
    this.overlay.setAttribute("aria-hidden", "true");
    this.overlay.append(this.line);
    this.ring.setAttribute("aria-hidden", "true");
    this.ring.hidden = true;
    document.body.append(this.overlay, this.ring);
  }

  /** Brings itself up to date; `hidden`: somebody wears a headset, or a dialog is open. */
  update(nowMs: number, hidden: boolean): void {
    const { guide } = this;
    if (this.card.hidden !== (hidden || guide.phase === "idle")) this.version = -1;
    if (this.version !== guide.version) {
      this.version = guide.version;
      this.show(hidden);
    }
    if (this.card.hidden && !this.drawn.shown) return;
    this.point(nowMs);
  }

  private build(): void {
    this.card.setAttribute("aria-label", "Guide");
    this.live.setAttribute("role", "status");
    this.bar.max = 1;
    this.bar.setAttribute("aria-label", "How much of it is done");
    this.meter.append(this.bar, this.figure);
    const row = make("div", "guide-buttons");
    row.append(this.skipButton, make("span", "space"), this.backButton, this.nextButton);
    this.card.append(this.count, this.title, this.text, this.meter, this.praise, row, this.live);
    this.nextButton.title = "Enter";
    this.skipButton.title = "Escape";
  }

  private show(hidden: boolean): void {
    const { guide, card } = this;
    card.hidden = hidden || guide.phase === "idle";
    card.dataset["phase"] = guide.phase;
    const { step } = guide;
    if (step !== this.step) {
      this.step = step;
      this.finder.aim(step?.look(guide.situation) ?? null);
    }
    if (card.hidden) return;
    if (step === null) this.showOffer();
    else this.showStep(step);
  }

  private showOffer(): void {
    const at = this.guide.resumesAt;
    setText(this.count, "Guide");
    setText(this.title, at === null ? "First time here?" : "Go on with the guide?");
    setText(this.text, at === null
      ? "In two minutes you learn by doing: move the catheter, look around, see with ultrasound, reach a target."
      : `You were at step ${at} of ${this.guide.steps.length}.`);
    this.meter.hidden = this.praise.hidden = this.backButton.hidden = true;
    setText(this.skipButton, "No, thank you");
    setText(this.nextButton, at === null ? "Show me" : "Go on");
    this.tell(`${this.title.textContent} ${this.text.textContent}`);
  }

  private showStep(step: Step): void {
    const { guide } = this;
    const { trial, done } = guide;
    card(this.card, done);
    setText(this.count, `Guide · ${guide.index + 1} of ${guide.steps.length}`);
    setText(this.title, step.title);
    setText(this.text, wordsOf(step, guide.situation));
    this.meter.hidden = done || trial.task.kind === "read" || guide.progress === "";
    this.bar.hidden = trial.task.kind === "setting" || trial.task.kind === "taken";
    this.bar.value = trial.share;
    setText(this.figure, guide.progress);
    this.praise.hidden = !done;
    setText(this.praise, step.praise);
    this.backButton.hidden = guide.index === 0;
    this.skipButton.hidden = guide.last;
    setText(this.skipButton, "Skip the guide");
    setText(this.nextButton, guide.last ? "Done" : "Next");
    this.nextButton.classList.toggle("ready", done || trial.task.kind === "read");
    this.tell(done ? `Done. ${step.praise}` : `${step.title}. ${this.text.textContent}`);
  }

  /** Tells who hears the page what is new; not every figure of it. */
  private tell(words: string): void {
    if (words === this.said) return;
    this.said = words;
    this.live.textContent = words;
  }

  /** Draws ring and line where the anchor is now. */
  private point(nowMs: number): void {
    const place = this.finder.update(nowMs);
    const { drawn, ring } = this;
    const shown = place.shown && !this.card.hidden && !this.guide.done;
    const same = shown === drawn.shown && Math.abs(place.x - drawn.x) < SEEN_PX && Math.abs(place.y - drawn.y) < SEEN_PX
      && Math.abs(place.w - drawn.w) < SEEN_PX && Math.abs(place.h - drawn.h) < SEEN_PX;
    if (same) return;
    Object.assign(drawn, place);
    drawn.shown = shown;
    ring.hidden = !shown;
    this.overlay.style.display = shown ? "" : "none";
    if (!shown) return;
    ring.classList.toggle("round", place.round);
    ring.style.transform = `translate(${place.x.toFixed(1)}px, ${place.y.toFixed(1)}px)`;
    ring.style.width = `${place.w.toFixed(1)}px`;
    ring.style.height = `${place.h.toFixed(1)}px`;
    this.connect(place);
  }

  /** From the nearest point of the card's edge to the nearest of the ring's. */
  private connect(place: Place): void {
    const box = this.card.getBoundingClientRect();
    const cx = place.x + place.w / 2;
    const cy = place.y + place.h / 2;
    const x1 = clamp(cx, box.left, box.right);
    const y1 = clamp(cy, box.top + beside(cx, box.left, box.right), box.bottom - CORNER_PX);
    let x2 = clamp(x1, place.x, place.x + place.w);
    let y2 = clamp(y1, place.y, place.y + place.h);
    if (x2 !== x1) y2 = clamp(y1, place.y, place.y + place.h - Math.min(CORNER_PX, place.h / 2));
    if (place.round) {
      const away = Math.hypot(x1 - cx, y1 - cy) || 1;
      x2 = cx + ((x1 - cx) / away) * (place.w / 2);
      y2 = cy + ((y1 - cy) / away) * (place.w / 2);
    }
    const ends = { x1, y1, x2, y2 };
    for (const [name, value] of Object.entries(ends)) this.line.setAttribute(name, value.toFixed(1));
  }
}

function card(element: HTMLElement, done: boolean): void {
  element.dataset["done"] = String(done);
}

/** A line to the side begins below the card's corner, one upwards at its edge. */
function beside(x: number, left: number, right: number): number {
  return x < left || x > right ? CORNER_PX : 0;
}

function clamp(value: number, low: number, high: number): number {
  return Math.min(high, Math.max(low, value));
}

function button(label: string, name: string, act: () => void): HTMLButtonElement {
  const made = make("button", name, label);
  made.type = "button";
  made.addEventListener("click", act);
  return made;
}
