/** Leads somebody through the steps: which one it is, whether it is done, what is remembered. No page, no drawing. */

import type { Measured, Situation } from "./situation";
import { inHeadset } from "./situation";
import type { Step } from "./steps";
import { STEPS } from "./steps";
import { progressText, Trial } from "./trial";

/** Time to see that a step is done, before the next one comes. */
export const LINGER_MS = 2200;
/** An offer that nobody takes goes away by itself. */
export const OFFER_MS = 45_000;

export type Phase = "idle" | "offered" | "running";

/** How far somebody came: on pages and in headsets apart, where other things have to be learnt. */
export interface Note {
  readonly state: "offered" | "running" | "left" | "finished";
  /** The step that is to be taken up again. */
  readonly at: string;
}

export interface Memory {
  read(kind: "page" | "headset"): Note | null;
  write(kind: "page" | "headset", note: Note): void;
}

const EMPTY: Situation = {
  place: "mouse", mover: "nobody", roll: false, heart: false, space: true, free: true, settings: true, ice: true, targets: true,
};

export class Guide {
  phase: Phase = "idle";
  /** Counts what is to be shown anew. */
  version = 0;
  /** Whether the present step is done. */
  done = false;
  readonly trial = new Trial();
  /** Called when a step is met by doing it; when the step changes, with null at the end. */
  onMet: () => void = () => undefined;
  onStep: (step: Step | null, before: Step | null) => void = () => undefined;
  private now = EMPTY;
  private list: readonly Step[] = [];
  private at = "";
  private readonly met = new Set<string>();
  private metMs = Infinity;
  private offeredMs = 0;
  private shown = "";

  constructor(private readonly memory: Memory, private readonly all: readonly Step[] = STEPS) {
    this.list = all;
  }

  get steps(): readonly Step[] {
    return this.list;
  }

  get situation(): Situation {
    return this.now;
  }

  /** The present step; null while the guide does not run. */
  get step(): Step | null {
    return this.phase === "running" ? this.list[this.index] ?? null : null;
  }

  get index(): number {
    return Math.max(0, this.list.findIndex(({ id }) => id === this.at));
  }

  get last(): boolean {
    return this.index === this.list.length - 1;
  }

  /** What has been done of the present step, for people. */
  get progress(): string {
    return progressText(this.trial);
  }

  /** The step that the guide would go on with, 1 for the first; null: it would begin anew. */
  get resumesAt(): number | null {
    const note = this.memory.read(this.kind);
    if (note === null || (note.state !== "left" && note.state !== "running")) return null;
    const index = this.list.findIndex(({ id }) => id === note.at);
    return index > 0 ? index + 1 : null;
  }

  /** Takes another situation: steps come and go, the present one stays where it can. */
  enter(now: Situation): void {
    const was = this.step;
    const before = this.now;
    const index = this.index;
    this.now = now;
    this.list = this.all.filter((step) => step.fits(now));
    this.version += 1;
    if (was === null) return;
    if (inHeadset(before.place) !== inHeadset(now.place)) this.note("running"); // it goes on there
    if (this.list.includes(was)) {
      if (!this.done && JSON.stringify(was.task(now)) !== JSON.stringify(this.trial.task)) this.trial.begin(was.task(now));
      return;
    }
    this.go(this.list[Math.min(index, this.list.length - 1)] ?? null, was);
  }

  /** Offers itself to who has not been offered it here before, or left in the middle by loading the page anew. */
  offer(nowMs: number): void {
    const note = this.memory.read(this.kind);
    if (this.phase !== "idle" || (note !== null && note.state !== "running")) return;
    this.phase = "offered";
    this.offeredMs = nowMs;
    if (note === null) this.memory.write(this.kind, { state: "offered", at: "" });
    this.version += 1;
  }

  /** Says no to the offer. */
  decline(): void {
    if (this.phase !== "offered") return;
    this.phase = "idle";
    const note = this.memory.read(this.kind);
    if (note?.state === "running") this.memory.write(this.kind, { state: "left", at: note.at });
    this.version += 1;
  }

  /** Begins, where it was left unless `anew`. */
  start(anew = false): void {
    const was = this.step;
    const from = anew ? null : this.resumesAt;
    if (from === null) this.met.clear();
    this.phase = "running";
    this.go(this.list[from === null ? 0 : from - 1] ?? null, was);
  }

  next(): void {
    if (this.phase === "offered") this.start();
    else if (this.phase !== "running") return;
    else if (this.last) this.finish();
    else this.go(this.list[this.index + 1] ?? null, this.step);
  }

  back(): void {
    if (this.phase === "running" && this.index > 0) this.go(this.list[this.index - 1] ?? null, this.step);
  }

  /** Leaves the guide, or says no to its offer; returns whether there was anything to leave. */
  skip(): boolean {
    if (this.phase === "offered") this.decline();
    else if (this.phase !== "running") return false;
    else if (this.last) this.finish();
    else {
      this.note("left");
      this.leave();
    }
    return true;
  }

  /** Takes a frame. */
  update(now: Measured): void {
    if (this.phase === "offered" && now.nowMs - this.offeredMs > OFFER_MS) this.decline();
    const { step } = this;
    if (step === null) return;
    if (this.done) {
      if (now.nowMs - this.metMs >= LINGER_MS) this.next();
      return;
    }
    const met = this.trial.update(now);
    if (met) {
      this.done = true;
      this.metMs = now.nowMs;
      this.met.add(step.id);
      this.version += 1;
      this.onMet();
      return;
    }
    const { progress } = this;
    if (progress === this.shown) return;
    this.shown = progress;
    this.version += 1;
  }

  private finish(): void {
    this.memory.write(this.kind, { state: "finished", at: "" });
    this.leave();
  }

  private leave(): void {
    const was = this.step;
    this.phase = "idle";
    this.done = false;
    this.version += 1;
    this.onStep(null, was);
  }

  private go(step: Step | null, was: Step | null): void {
    if (step === null) {
      if (this.phase === "running") this.leave();
      return;
    }
    this.at = step.id;
    this.trial.begin(step.task(this.now));
    // One that was done before needs not be done again; it does not go on by itself either.
    this.done = this.met.has(step.id);
    this.metMs = Infinity;
    this.shown = this.progress;
    this.version += 1;
    this.note("running");
    this.onStep(step, was);
  }

  private note(state: "running" | "left"): void {
    this.memory.write(this.kind, { state, at: this.at });
  }

  private get kind(): "page" | "headset" {
    return inHeadset(this.now.place) ? "headset" : "page";
  }
}
