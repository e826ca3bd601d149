/** The guide in the page's program: reads the scene, leads through the steps, shows itself on the page or in the headset. */

import type { SceneDescription } from "../generated/messages";
import { ReachedTone } from "../scene/tone";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import { pageStorage } from "../stage/storage";
import { toast } from "../ui/toasts";
import type { Immersion } from "../xr/immersion";
import type { GuideDebug } from "./debug";
import { guideDebug } from "./debug";
import { Guide } from "./guide";
import { HandLabels } from "./hand_labels";
import { wireHelp } from "./help_dialog";
import { StoredMemory } from "./memory";
import { PageGuide } from "./page_guide";
import { Practice } from "./practice";
import type { Steers } from "./sensor";
import { Sensor } from "./sensor";
import type { Situation } from "./situation";
import type { Step } from "./steps";
import { XrGuide } from "./xr_guide";

const LOOK_EVERY_MS = 250;
/** Somebody who has just come looks round first. */
const OFFER_AFTER_MS = 1500;
/** Higher and softer than the tone of a target. */
const NOTES_HZ = [880, 1320];
const LOUDNESS = 0.09;

export class GuideFeature implements Feature {
  readonly guide = new Guide(new StoredMemory(pageStorage()));
  private readonly sensor: Sensor;
  private readonly page: PageGuide;
  private readonly plate: XrGuide;
  private readonly labels: HandLabels;
  private readonly practice: Practice;
  private readonly tone = new ReachedTone(NOTES_HZ, LOUDNESS);
  private scene: SceneDescription | null = null;
  private situation: Situation | null = null;
  private lookedMs = -Infinity;
  private sinceMs = NaN;
  private immersive = false;
  /** Whether targets were shown before the guide showed them. */
  private targetsBefore: boolean | null = null;
  private placedSteered = false;
  private offers = true;
  private toldStep: Step | null = null;
  private toldWords = "";

  constructor(private readonly stage: Stage, immersion: Immersion, steers: Steers) {
    const { guide } = this;
    this.sensor = new Sensor(stage, immersion, steers);
    this.page = new PageGuide(guide, stage);
    this.plate = new XrGuide(guide, stage, immersion, steers);
    this.labels = new HandLabels(immersion, stage.view);
    this.practice = new Practice(stage);
    guide.onMet = () => this.chime();
    guide.onStep = (step, before) => this.change(step, before);
    immersion.acts.guide = () => {
      immersion.menu.close();
      guide.start();
      this.plate.stand();
    };
    wireHelp(guide);
    for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, () => this.wake(), { passive: true });
    if (new URLSearchParams(location.search).get("guide") === "0") this.offers = false;
  }

  describe(scene: SceneDescription): void {
    this.scene = scene;
    this.practice.remove();
    this.sensor.describe(scene);
    this.sinceMs = NaN;
  }

  /** Takes whether an encoder is connected. */
  takeRoll(present: boolean): void {
    this.sensor.encoder = present;
  }

  update(frame: Frame): boolean {
    const { guide, sensor } = this;
    if (!sensor.ready) return false;
    sensor.update(frame);
    this.lookAround(frame);
    // A script that is taken over from only now has gone somewhere else meanwhile.
    if (guide.step?.id === "target" && (!this.practice.placed || (sensor.now.steered && !this.placedSteered))) this.placeTarget(frame);
    guide.update(sensor.now);
    this.page.update(frame.nowMs, frame.immersive);
    this.plate.update(frame);
    this.labels.update(frame, guide.phase === "running");
    return false;
  }

  /** The step that is shown, for those who follow; empty while none is. */
  get told(): string {
    const { guide } = this;
    const { step } = guide;
    if (guide.phase !== "running" || step === null) return "";
    if (step !== this.toldStep) {
      this.toldStep = step;
      this.toldWords = `${guide.index + 1} of ${guide.steps.length}, ${step.title}`;
    }
    return this.toldWords;
  }

  get debug(): GuideDebug {
    return guideDebug(this.guide, this.plate);
  }

  /** Goes on to the next step; returns whether the guide runs. An offer is taken by its button only. */
  goOn(): boolean {
    if (this.guide.phase !== "running") return false;
    this.guide.next();
    return true;
  }

  /** Works out now and then in what situation somebody is, and offers the guide to who is new. */
  private lookAround({ nowMs, immersive }: Frame): void {
    if (immersive !== this.immersive || Number.isNaN(this.sinceMs)) {
      this.immersive = immersive;
      this.sinceMs = nowMs;
      this.lookedMs = -Infinity;
    }
    if (nowMs - this.lookedMs < LOOK_EVERY_MS) return;
    this.lookedMs = nowMs;
    const now = this.sensor.situation(immersive);
    if (this.situation === null || !same(now, this.situation)) {
      this.situation = now;
      this.guide.enter(now);
    }
    const settled = nowMs - this.sinceMs > OFFER_AFTER_MS;
    if (this.stage.training.atHand && this.guide.phase === "offered") this.guide.skip(); // a trial comes first
    if (settled && this.offers && now.free && !this.stage.training.atHand && this.sensor.now.known && this.guide.phase === "idle") this.guide.offer(nowMs);
  }

  private change(step: Step | null, before: Step | null): void {
    const { store } = this.stage;
    if (before?.id === "target") this.leaveTarget();
    if (step !== null && before === null && store.value.mode === "2d") this.sensor.quietly(() => store.set({ mode: "3d" }));
    if (step === null && this.guide.resumesAt !== null) toast("You can take the guide up again under Help (?).");
  }

  /** Shows a target to reach, once it is known where the tip is. */
  private placeTarget({ track }: Frame): void {
    const { scene, sensor, stage } = this;
    if (!sensor.now.known || track === null || scene === null || this.guide.done) return;
    this.targetsBefore ??= stage.store.value.targets;
    this.placedSteered = sensor.now.steered;
    sensor.quietly(() => stage.store.set({ targets: true }));
    const most = scene.twin === null ? Infinity : scene.twin.insertion_mm[1];
    this.practice.place(track, sensor.now.insertedMm, scene.roi_max_mm[0], most);
  }

  private leaveTarget(): void {
    this.practice.remove();
    const before = this.targetsBefore;
    this.targetsBefore = null;
    if (before === false) this.sensor.quietly(() => this.stage.store.set({ targets: false }));
  }

  private chime(): void {
    // The target sounds by itself.
    if (this.stage.store.value.sound && this.guide.step?.id !== "target") this.tone.play();
  }

  private wake(): void {
    if (this.guide.phase !== "idle" && this.stage.store.value.sound) this.tone.wake();
  }
}

function same(a: Situation, b: Situation): boolean {
  return a.place === b.place && a.mover === b.mover && a.roll === b.roll && a.heart === b.heart && a.space === b.space
    && a.free === b.free && a.settings === b.settings && a.ice === b.ice && a.targets === b.targets;
}
