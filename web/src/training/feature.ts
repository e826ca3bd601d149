/** Training in the page's program: takes what the server says, shows it on the page, in the scene and in the headset. */

import type { ServerMessage, TrainingState } from "../generated/messages";
import type { Commands } from "../link/commands";
import { ReachedTone } from "../scene/tone";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import { pageStorage } from "../stage/storage";
import type { Immersion } from "../xr/immersion";
import { Choice } from "./choice";
import type { TrainingDebug } from "./debug";
import { trainingDebug } from "./debug";
import { Desk } from "./desk";
import type { Watching } from "./page/instructor_view";
import { TrainingPanel } from "./page/panel";
import { ReplayBar } from "./page/replay_bar";
import { StageStrip } from "./page/stage_strip";
import { KeypadPlate } from "./xr/keypad_plate";
import { ResultPlate } from "./xr/result_plate";
import type { TrainingAct } from "./xr/rows";
import { trainingRows } from "./xr/rows";
import { SurveyPlate } from "./xr/survey_plate";
import { TrialPlate } from "./xr/trial_plate";

/** Figures and countdowns are brought up to date this often at most. */
const FIGURES_MS = 100;
const GO_HZ = [880];
/** A server that has training says so at once. */
const TOLD_WITHIN_MS = 5000;

export class TrainingFeature implements Feature {
  readonly desk: Desk;
  private readonly choice: Choice;
  private readonly panel: TrainingPanel;
  private readonly strip: StageStrip;
  private readonly bar: ReplayBar;
  private readonly plate: TrialPlate;
  private readonly result: ResultPlate;
  private readonly survey: SurveyPlate;
  private readonly keypad: KeypadPlate;
  private readonly tone = new ReachedTone();
  private readonly go = new ReachedTone(GO_HZ);
  private figuresMs = -Infinity;
  private figures: TrainingState["now"] = null;
  private phase: TrainingState["phase"] = "idle";
  private menuVersion = -1;
  /** Messages about training so far. */
  private told = 0;

  constructor(private readonly stage: Stage, private readonly immersion: Immersion, commands: Commands, watching: Watching) {
    const { training, replay } = stage;
    this.choice = new Choice(training);
    this.desk = new Desk(training, this.choice, commands);
    const show = (): void => void this.showRun();
    this.panel = new TrainingPanel(training, this.desk, watching, show, pageStorage());
    this.strip = new StageStrip(training);
    this.bar = new ReplayBar(replay, (key) => training.offer?.tasks.find((each) => each.key === key)?.name ?? key);
    this.plate = new TrialPlate(training);
    stage.view.scene.add(this.plate.group);
    this.result = new ResultPlate(stage, this.desk, show);
    this.survey = new SurveyPlate(stage, this.desk);
    this.keypad = new KeypadPlate(stage, this.choice);
    immersion.headUps.push(this.plate);
    immersion.acts.training = {
      rows: () => trainingRows({ model: training, choice: this.choice, desk: this.desk, replay }),
      act: (what) => this.act(what),
    };
    training.onReached = () => {
      if (stage.store.value.sound) this.tone.play();
    };
    training.listen(() => {
      stage.view.touch();
      this.begin();
    });
    for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, () => this.wake(), { passive: true });
  }

  /**
   * A link has opened. What was known stays until the server tells it anew, so that a survey that is being filled in
   * survives a break; a server that tells nothing has no training.
   */
  greet(): void {
    const { training } = this.stage;
    const { told } = this;
    setTimeout(() => {
      if (this.told === told && training.linked) training.forget();
    }, TOLD_WITHIN_MS);
  }

  /** Takes a message; returns whether it was one of these. */
  take(message: ServerMessage): boolean {
    if (message.type !== "training" && message.type !== "training_offer") return false;
    this.told += 1;
    if (message.type === "training") this.stage.training.takeState(message, performance.now());
    else this.stage.training.takeOffer(message);
    return true;
  }

  update(frame: Frame): boolean {
    const { training, replay } = this.stage;
    const { nowMs, immersive } = frame;
    if (nowMs - this.figuresMs >= FIGURES_MS) {
      this.figuresMs = nowMs;
      this.plate.update(immersive, nowMs);
      if (this.figures !== training.now || training.phase === "countdown" || training.phase !== this.phase) {
        this.figures = training.now;
        this.phase = training.phase;
        this.strip.show(nowMs);
        this.panel.showFigures();
      }
      if (replay.shown) this.bar.show();
    }
    if (training.version !== this.menuVersion) {
      this.menuVersion = training.version;
      this.immersion.menu.refresh();
      this.bar.show();
      this.strip.show(nowMs);
    }
    this.keypad.follow(immersive && this.keypad.wanted, nowMs);
    this.survey.follow(immersive && this.survey.wanted && !this.keypad.wanted, nowMs);
    this.result.follow(immersive && this.result.wanted && !this.survey.wanted && !this.keypad.wanted, nowMs);
    return false;
  }

  get debug(): TrainingDebug {
    return trainingDebug(this.stage, this.choice, { trial: this.plate, result: this.result, survey: this.survey, keypad: this.keypad });
  }

  /** A run that is shown again makes way for the next trial, and what was closed in the headset comes again with it. */
  private begin(): void {
    const { training, replay } = this.stage;
    if (!training.atHand) return;
    if (replay.shown) replay.stop();
    if (training.phase === "running" && this.phase === "countdown" && this.stage.store.value.sound) this.go.play();
  }

  private async showRun(): Promise<void> {
    const path = this.stage.training.result?.run ?? null;
    if (path !== null) await this.stage.replay.load(path);
  }

  private act(what: TrainingAct): void {
    const { choice, desk, stage: { replay } } = this;
    const acts: Readonly<Record<TrainingAct, () => unknown>> = {
      start: () => desk.start(),
      prepare: () => desk.prepare(),
      pause: () => desk.pause(),
      abort: () => desk.abort(),
      repeat: () => desk.repeat(),
      close: () => desk.close(),
      "participant next": () => choice.stepParticipant(1),
      "participant previous": () => choice.stepParticipant(-1),
      code: () => this.keypad.ask(),
      "task next": () => choice.stepTask(1),
      "task previous": () => choice.stepTask(-1),
      "view 2d": () => (choice.view = "2d"),
      "view 3d": () => (choice.view = "3d"),
      "view free": () => (choice.view = "free"),
      result: () => this.result.reopen(),
      survey: () => this.survey.reopen(),
      replay: () => this.showRun(),
      "replay play": () => replay.toggle(),
      "replay stop": () => replay.stop(),
    };
    void acts[what]();
  }

  private wake(): void {
    if (!this.stage.store.value.sound) return;
    this.tone.wake();
    this.go.wake();
  }
}
