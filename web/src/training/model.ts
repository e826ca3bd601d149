/** How training stands, as the server last told it: read by the page, the scene and the headset. No DOM, no drawing. */

import type {
  SurveyDescription, TrainingNow, TrainingOffer, TrainingResult, TrainingRun, TrainingState, TrainingTarget,
} from "../generated/messages";

export type Phase = TrainingState["phase"];
export type View = TrainingRun["view"];

/** The commands of training. */
export type TrainingCommand =
  | "training_prepare" | "training_begin" | "training_pause" | "training_resume" | "training_abort" | "training_repeat"
  | "training_close" | "training_mark" | "training_continue" | "training_store" | "survey_answer";

/** In these phases a trial is at hand: its targets stand in the scene. */
const AT_HAND: ReadonlySet<Phase> = new Set(["ready", "countdown", "running", "paused"]);
const UNDER_WAY: ReadonlySet<Phase> = new Set(["countdown", "running", "paused"]);

export class TrainingModel {
  offer: TrainingOffer | null = null;
  state: TrainingState | null = null;
  /** Whether this page may command. */
  operating = false;
  /** Whether the link is up: what is known is else what was. */
  linked = false;
  /** Counts changes of anything but `state.now` and the countdown. */
  version = 0;
  /** Told once for each target that the present trial reaches. */
  onReached: (target: TrainingTarget) => void = () => undefined;
  private readonly listeners = new Set<() => void>();
  private shape = "";
  private countdownEndsMs = NaN;

  get phase(): Phase {
    return this.state?.phase ?? "idle";
  }

  get run(): TrainingRun | null {
    return this.state?.run ?? null;
  }

  get now(): TrainingNow | null {
    return this.state?.now ?? null;
  }

  get result(): TrainingResult | null {
    return this.phase === "ended" ? this.state?.result ?? null : null;
  }

  get survey(): SurveyDescription | null {
    return this.state?.survey ?? null;
  }

  /** Whether a trial's targets stand in the scene. */
  get atHand(): boolean {
    return AT_HAND.has(this.phase) && this.run !== null;
  }

  /** Whether a trial counts down, runs or is paused. */
  get underWay(): boolean {
    return UNDER_WAY.has(this.phase) && this.run !== null;
  }

  /** The target that is offered now; before the first, the first. */
  get target(): TrainingTarget | null {
    const { run, now } = this;
    if (run === null) return null;
    return run.targets.find(({ key }) => key === now?.target) ?? run.targets.find(({ state }) => state === "now")
      ?? (this.phase === "ready" || this.phase === "countdown" ? run.targets[0] ?? null : null);
  }

  /** Whether the server would carry out a command of this page now. */
  can(command: TrainingCommand): boolean {
    return this.linked && this.operating && (this.state?.can.includes(command) ?? false);
  }

  /** Seconds until the trial begins, from `nowMs` (page time); null while nothing counts down. */
  countdownS(nowMs: number): number | null {
    return this.phase !== "countdown" || Number.isNaN(this.countdownEndsMs) ? null : Math.max(0, (this.countdownEndsMs - nowMs) / 1000);
  }

  takeOffer(offer: TrainingOffer): void {
    this.offer = offer;
    this.change();
  }

  /** Takes a state that came at `nowMs`, page time. */
  takeState(state: TrainingState, nowMs: number): void {
    const before = this.state;
    this.state = state;
    this.countdownEndsMs = state.countdown_s === null ? NaN : nowMs + 1000 * state.countdown_s;
    this.tellReached(before);
    const shape = shapeOf(state);
    if (shape === this.shape) return;
    this.shape = shape;
    this.change();
  }

  /** Says whether the link is up and whether this page may command. */
  setRole(linked: boolean, operating: boolean): void {
    if (linked === this.linked && operating === this.operating) return;
    this.linked = linked;
    this.operating = operating;
    this.change();
  }

  /** Another server: what was known is of another one. */
  forget(): void {
    this.offer = this.state = null;
    this.shape = "";
    this.countdownEndsMs = NaN;
    this.change();
  }

  /** Calls `listener` after every change but of figures, until what is returned is called. */
  listen(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Says that something that is shown with this has changed. */
  change(): void {
    this.version += 1;
    for (const listener of [...this.listeners]) listener();
  }

  private tellReached(before: TrainingState | null): void {
    const { run, state } = this;
    if (run === null || state === null || before?.run?.id !== run.id) return;
    // In practice the targets come round again: what counts is how many were reached.
    if ((state.now?.reached ?? 0) <= (before.now?.reached ?? 0)) return;
    const reached = run.targets.find(({ key }) => key === before.now?.target) ?? run.targets[0];
    if (reached !== undefined) this.onReached(reached);
  }
}

/** What a change of which is more than new figures. */
function shapeOf(state: TrainingState): string {
  const { now, countdown_s: _, ...rest } = state;
  return JSON.stringify([rest, now?.target ?? null, now?.number ?? 0, now?.reached ?? 0, now?.in_a_row ?? 0, now?.hindrance ?? ""]);
}
