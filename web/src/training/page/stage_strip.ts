/** Over the page's picture: the countdown, large, and a strip with target, error, dwell and time left. Nothing to press. */

import { byId, make, setText } from "../../ui/dom";
import type { TrainingModel } from "../model";
import { countWords, errorWords, PHASE_WORDS, timeLeft } from "../words";
import { DwellRing, say } from "./parts";

export class StageStrip {
  private readonly count = make("div", "training-countdown");
  private readonly strip = make("div", "training-strip");
  private readonly ring = new DwellRing();
  private readonly target = make("strong");
  private readonly number = make("span", "faint");
  private readonly error = make("b");
  private readonly left = make("b", "time");
  private readonly note = make("span", "note");
  private readonly live = make("p", "unseen");
  private said = "";

  constructor(private readonly model: TrainingModel) {
    this.count.setAttribute("aria-hidden", "true");
    this.strip.setAttribute("aria-hidden", "true"); // the panel has the same in words
    this.live.setAttribute("role", "status");
    this.live.id = "training-live";
    this.strip.append(this.ring.element, this.target, this.number, this.error, this.left, this.note);
    byId("view").parentElement!.append(this.strip, this.count, this.live);
    this.show(0);
  }

  /** Brings itself up to date; called with every state, and while a countdown runs. */
  show(nowMs: number): void {
    const { model } = this;
    const countdown = model.countdownS(nowMs);
    this.count.hidden = countdown === null;
    if (countdown !== null) setText(this.count, countdown <= 0 ? "Go" : String(Math.ceil(countdown)));
    this.strip.hidden = !model.atHand;
    byId("view").parentElement!.dataset["training"] = String(model.atHand);
    this.tell();
    if (this.strip.hidden) return;
    const { now, target, run, phase } = model;
    this.strip.dataset["phase"] = phase;
    this.ring.show(now?.progress ?? 0);
    setText(this.target, target?.name ?? run?.name ?? "");
    say(this.number, now === null || phase === "ready" ? PHASE_WORDS[phase] : countWords(now));
    say(this.error, now === null || phase !== "running" ? "" : errorWords(target, now));
    setText(this.left, timeLeft(now?.remaining_s ?? run?.limit_s ?? 0));
    say(this.note, phase === "paused" ? "Paused: the time stands still" : phase === "running" ? now?.hindrance ?? "" : "");
  }

  /** Says what is new to who hears the page: phases and targets, not every figure. */
  private tell(): void {
    const { model } = this;
    const { run, now, target, phase, result } = model;
    let words = "";
    if (phase === "countdown") words = "The trial starts in three seconds.";
    else if (phase === "ended") words = result?.sentence ?? "The trial has ended.";
    else if (phase === "paused") words = "Paused.";
    else if (phase === "ready") words = `Ready: ${run?.name ?? ""}.`;
    else if (phase === "running" && target !== null) words = `Target ${now === null ? "" : countWords(now)}: ${target.name}.`;
    if (words === this.said) return;
    this.said = words;
    this.live.textContent = words;
  }
}
