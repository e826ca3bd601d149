/** The page's program: the link's messages in, the scene and the panels out. */

import type { EventMessage, HealthMessage, Hello, SceneDescription, ServerMessage, SessionMessage, TrackMessage } from "./generated/messages";
import type { DebugHandle } from "./debug";
import { HeadsetLog } from "./diag/headset_log";
import { Company } from "./follow/company";
import { GuideFeature } from "./guide/feature";
import type { Steers } from "./guide/sensor";
import { linkAddress } from "./link/address";
import { Commands } from "./link/commands";
import type { LinkState } from "./link/link";
import { Link } from "./link/link";
import type { Control } from "./link/steering";
import { Steering } from "./link/steering";
import { TrackLog } from "./link/tracks";
import { polylineLength } from "./maths/centreline";
import { RateMeter, Recent } from "./maths/statistics";
import { sceneReport } from "./scene/report";
import { Stagecraft } from "./scene/stagecraft";
import type { Settings } from "./settings";
import { SettingsStore } from "./stage/settings";
import { pageStorage } from "./stage/storage";
import { condition, GRAPHICS_LOST } from "./ui/condition";
import { ControlRows } from "./ui/controls";
import { TrainingFeature } from "./training/feature";
import { byId, setText } from "./ui/dom";
import { EnterButtons } from "./ui/enter";
import { HeadsetDialog } from "./ui/headset";
import { HeartLoader } from "./ui/heart";
import { Keys } from "./ui/keys";
import { Numbers } from "./ui/numbers";
import { Operator } from "./ui/operator";
import { Pictures } from "./ui/pictures";
import { RollPanel } from "./ui/roll";
import { Sliders } from "./ui/sliders";
import { Stage } from "./ui/stage";
import type { Actions } from "./ui/strokes";
import { makeStrokes, wireViews } from "./ui/strokes";
import { makeTabs } from "./ui/tabs";
import { toast, toastEvent } from "./ui/toasts";
import { Immersion } from "./xr/immersion";
import { xrDebug } from "./xr/report";

const PANEL_EVERY_MS = 100;
const SCENE_RETRY_MS = 1500;

export class App {
  private readonly tracks = new TrackLog();
  private readonly trackRate = new RateMeter();
  private readonly latency = new Recent();
  private readonly trackLatency = new Recent();
  private readonly link: Link;
  private readonly commands: Commands;
  private readonly store = new SettingsStore(pageStorage());
  private readonly stagecraft: Stagecraft;
  private readonly stage = new Stage(() => this.link.start());
  private readonly numbers = new Numbers();
  private readonly pictures: Pictures;
  private readonly sliders: Sliders;
  private readonly steering: Steering;
  private readonly keys: Keys;
  private readonly operator: Operator;
  private readonly roll: RollPanel;
  private readonly heart: HeartLoader;
  private readonly company: Company;
  private readonly headset = new HeadsetDialog(new URL("api/access", document.baseURI).href);
  private readonly headsetLog = new HeadsetLog(pageStorage(), {
    scriptMs: () => this.stagecraft.view.times.lastCostMs,
    rateHz: () => this.immersion.sessions.rateHz,
  });
  private readonly immersion: Immersion;
  private readonly guide: GuideFeature;
  private readonly training: TrainingFeature;
  private linkState: LinkState = { phase: "connecting", sentence: "", retryAtMs: null };
  private health: HealthMessage | null = null;
  private sceneText = "";
  private lastTrackMs = performance.now();
  private lastPanelMs = 0;
  private handSteered = false;
  private graphicsLost = false;

  /** Throws Error when the browser gives no WebGL 2. */
  constructor(settings: Settings, private readonly errors: { readonly count: number }) {
    this.link = new Link(linkAddress(document.baseURI), {
      onState: (state) => this.takeLinkState(state),
      onHello: (hello) => this.takeHello(hello),
      onMessage: (message) => this.take(message),
    });
    this.commands = new Commands((message) => this.link.send(message));
    this.steering = new Steering((name, args) => this.commands.ask(name, args), (sentence) => toast(sentence, "bad"));
    this.stagecraft = new Stagecraft(byId<HTMLCanvasElement>("view"), settings, this.store);
    this.immersion = new Immersion(this.stagecraft.stage);
    this.stagecraft.features.unshift(this.immersion); // what the hands do comes first
    this.heart = new HeartLoader(this.stagecraft, settings, this.store);
    this.company = new Company(this.stagecraft.stage, (message) => this.link.send(message));
    this.stagecraft.add(this.company.mirror);
    this.stagecraft.add(this.headsetLog);
    this.stagecraft.view.onGraphicsLost = (lost) => this.takeGraphics(lost);
    new EnterButtons(this.immersion.sessions, {
      onReason: (sentence) => void this.headset.open(sentence),
      onMode: (mode) => (mode === null ? this.headsetLog.end() : this.headsetLog.begin(mode)),
    });
    new ControlRows(this.store);
    this.store.listen(() => this.showHeld());
    this.pictures = new Pictures(this.tracks, settings.picturesHz);
    this.sliders = new Sliders({
      onControl: (control, value) => this.steer(control, value),
      onManoeuvre: (name) => void this.startManoeuvre(name),
    });
    this.keys = new Keys({
      onNudge: (control, amount) => this.sliders.nudge(control, amount),
      onStroke: makeStrokes(this.actions()),
    });
    this.roll = new RollPanel(this.commands);
    this.roll.onChange = () => this.immersion.menu.refresh();
    this.immersion.acts.roll = this.roll;
    this.operator = new Operator(this.commands, (steering, operating) => {
      this.keys.steering = steering && this.sliders.ready;
      this.stagecraft.stage.training.setRole(this.linkState.phase === "live", operating);
    });
    this.guide = new GuideFeature(this.stagecraft.stage, this.immersion, this.steers());
    this.stagecraft.add(this.guide);
    this.company.guideStep = () => this.guide.told;
    this.training = new TrainingFeature(this.stagecraft.stage, this.immersion, this.commands, {
      people: this.company.people,
      status: () => byId("status").textContent ?? "",
      guideStep: () => this.company.people.guideStep,
    });
    this.stagecraft.add(this.training);
    wireViews(this.stagecraft.presets);
    makeTabs(() => this.pictures.refresh());
  }

  start(): void {
    this.stagecraft.presets.go("iso", performance.now());
    this.link.start();
    addEventListener("online", () => this.link.start());
    this.stagecraft.view.run((now) => this.frame(now));
  }

  debugHandle(): DebugHandle {
    const app = this;
    return {
      get frames() { return app.stagecraft.view.frames; },
      drawn: () => app.stagecraft.drawn(),
      scene: () => sceneReport(app.stagecraft),
      get status() { return byId("status").textContent ?? ""; },
      get link() { return app.linkState.phase; },
      get connections() { return app.link.connections; },
      received: () => app.tracks.received(),
      get lastSeq() { return app.tracks.newest?.seq ?? -1; },
      get consoleErrors() { return app.errors.count; },
      get pixelRatio() { return app.stagecraft.view.pixelRatio; },
      get heartParts() { return app.stagecraft.heart.parts.length; },
      get role() { return app.operator.role; },
      camera: () => app.stagecraft.view.camera.position.toArray(),
      xr: xrDebug(app.immersion, app.store),
      guide: app.guide.debug,
      training: app.training.debug,
      pictures: () => app.pictures.panels.map(({ camera, shownSeq, overlaid }) => ({ camera, seq: shownSeq, overlaid })),
    };
  }

  // --- messages ---------------------------------------------------------------------------------------------------

  private take(message: ServerMessage): void {
    if (this.company.take(message) || this.training.take(message)) return;
    switch (message.type) {
      case "track":
        this.takeTrack(message);
        break;
      case "health":
        this.health = message;
        break;
      case "session":
        this.takeSession(message);
        break;
      case "roll":
        this.roll.take(message);
        this.guide.takeRoll(message.present);
        break;
      case "event":
        this.takeEvent(message);
        break;
      case "refusal":
        if (!this.commands.takeRefusal(message)) toast(message.sentence, "bad");
        break;
    }
  }

  private takeTrack(track: TrackMessage): void {
    const now = performance.now();
    this.tracks.put(track);
    this.stagecraft.take(track, now);
    this.link.acknowledge(track.seq);
    this.lastTrackMs = now;
    this.trackRate.mark(now / 1000);
    const { offsetS } = this.link.clock;
    if (track.latency_ms === null) return; // a replay: its instants are not now
    this.trackLatency.add(track.latency_ms);
    if (offsetS !== null) this.latency.add(now + 1000 * (offsetS - track.t));
  }

  private takeEvent(event: EventMessage): void {
    if (this.commands.takeEvent(event)) return;
    if (event.kind === "controls") {
      this.sliders.show(event.payload as Partial<Record<Control, number>>);
    } else {
      toastEvent(event);
    }
  }

  private takeSession(session: SessionMessage): void {
    this.operator.showSession(session);
  }

  private takeLinkState(state: LinkState): void {
    const was = this.linkState.phase;
    this.linkState = state;
    if (was === "live" && state.phase !== "live") {
      this.commands.abandon();
      this.operator.leave();
      this.roll.leave();
      this.company.leave();
      this.pictures.setLinked(false);
      this.health = null;
      this.trackRate.clear();
      this.latency.clear();
      this.trackLatency.clear();
    }
    this.showPanels(performance.now());
  }

  /** A new link: perhaps another server, whose pairs count from 0 and whose scene differs. */
  private takeHello(hello: Hello): void {
    this.tracks.clear();
    this.stagecraft.forget();
    this.roll.leave();
    this.lastTrackMs = performance.now();
    this.operator.greet(hello);
    this.training.greet();
    this.company.greet(hello);
    if (this.link.connections > 1) {
      this.handSteered = false;
      this.sliders.forget();
    }
    byId("source").textContent = SOURCES[hello.source] ?? hello.source;
    byId("about").textContent = `${hello.software}, link version ${hello.protocol}.`;
    this.pictures.setLinked(true);
    void this.fetchScene(this.link.connections);
  }

  // --- scene ------------------------------------------------------------------------------------------------------

  private async fetchScene(connection: number): Promise<void> {
    const url = new URL("scene/scene.json", document.baseURI).href;
    while (this.link.connections === connection && this.linkState.phase === "live") {
      try {
        const response = await fetch(url, { cache: "no-store" });
        if (!response.ok) throw new Error(`status ${response.status}`);
        const text = await response.text();
        if (text !== this.sceneText) await this.describe(JSON.parse(text) as SceneDescription, url);
        this.sceneText = text;
        return;
      } catch (error) {
        toast(`The scene could not be loaded (${error instanceof Error ? error.message : "no answer"}); trying again.`, "bad");
        await new Promise((resolve) => setTimeout(resolve, SCENE_RETRY_MS));
      }
    }
  }

  private async describe(scene: SceneDescription, url: string): Promise<void> {
    this.stagecraft.describe(scene, url);
    this.stagecraft.presets.go("iso", performance.now());
    this.pictures.describe(scene);
    byId("catheter-name").textContent = `${scene.catheter_name}, ⌀ ${scene.catheter_diameter_mm} mm`;
    if (scene.twin !== null) this.sliders.describe(scene.twin);
    this.operator.describe(scene);
    await this.heart.show(scene.heart, url);
  }

  // --- steering ---------------------------------------------------------------------------------------------------

  private steer(control: Control, value: number): void {
    this.handSteered = true;
    this.steering.set(control, value);
  }

  private async startManoeuvre(name: string): Promise<void> {
    const answer = await this.commands.ask("manoeuvre", { name });
    if (answer.done) this.handSteered = false;
    else toast(answer.sentence, "bad");
  }

  // --- every frame ------------------------------------------------------------------------------------------------

  private frame(nowMs: number): void {
    this.keys.update(nowMs);
    this.pictures.update(nowMs);
    this.stagecraft.frame(nowMs, this.link.clock.offsetS);
    this.company.update(nowMs);
    if (nowMs - this.lastPanelMs >= PANEL_EVERY_MS) this.showPanels(nowMs);
  }

  private showPanels(nowMs: number): void {
    this.lastPanelMs = nowMs;
    const track = this.tracks.newest;
    const now = this.graphicsLost ? GRAPHICS_LOST : condition({
      link: this.linkState, track, trackAgeMs: nowMs - this.lastTrackMs, health: this.health, nowMs,
    });
    this.stage.show(now);
    this.immersion.tell(now);
    this.numbers.showTrack(now.stale ? null : track);
    this.numbers.showHealth(this.health);
    this.roll.show(now.stale ? null : track, this.operator.operating);
    this.numbers.showLink({
      trackRate: this.trackRate.rate(nowMs / 1000),
      pictureRate: this.pictures.showRates(nowMs / 1000),
      latencyMs: this.latency.percentile(0.5),
      trackLatencyMs: this.trackLatency.percentile(0.5),
    });
    if (!this.handSteered && track?.points && this.sliders.ready) this.followTrack(track);
  }

  /** While a script moves the twin, insertion and roll follow what is seen: taking over then does not jump. */
  private followTrack(track: TrackMessage): void {
    const values: Partial<Record<Control, number>> = { insertion_mm: polylineLength(track.points!) };
    if (track.roll !== null) values.roll_deg = (track.roll * 180) / Math.PI;
    this.sliders.show(values);
  }

  /** A headset would go on showing its last picture: its session ends, and the page says why. */
  private takeGraphics(lost: boolean): void {
    this.graphicsLost = lost;
    if (lost) this.immersion.sessions.leave();
    this.showPanels(performance.now());
  }

  /** Says over the scene's settings why some of them cannot be changed. */
  private showHeld(): void {
    const held = byId("held");
    const sentence = this.store.lock?.sentence ?? "";
    held.hidden = sentence === "";
    setText(held, sentence);
  }

  private actions(): Actions {
    return {
      presets: this.stagecraft.presets,
      toggleHeart: () => this.heart.toggle(),
      toggleLandmarks: () => this.heart.toggleLandmarks(),
      toggleRecording: () => this.operator.toggleRecording(),
      togglePicture: (camera) => this.pictures.enlarge(this.pictures.enlarged === camera ? null : camera),
      closeAll: () => this.pictures.enlarge(null) || this.guide.guide.skip(),
      goOn: () => this.guide.goOn(),
    };
  }

  /** The twin's steering, for the guide. */
  private steers(): Steers {
    const app = this;
    return {
      get able() { return app.keys.steering; },
      get byHand() { return app.handSteered; },
      nudge: (control, amount) => this.sliders.nudge(control, amount),
    };
  }
}

const SOURCES: Record<string, string> = { twin: "digital twin", cameras: "cameras", replay: "replay" };
