/** The page's program: the link's messages in, the scene and the panels out. */

import type { EventMessage, HealthMessage, Hello, SceneDescription, ServerMessage, SessionMessage, TrackMessage } from "./generated/messages";
import type { DebugHandle } from "./debug";
import { linkAddress } from "./link/address";
import { Commands } from "./link/commands";
import type { LinkState } from "./link/link";
import { Link } from "./link/link";
import type { Control } from "./link/steering";
import { Steering } from "./link/steering";
import { TrackLog } from "./link/tracks";
import { polylineLength } from "./maths/centreline";
import { RateMeter, Recent } from "./maths/statistics";
import { Stagecraft } from "./scene/stagecraft";
import type { Settings } from "./settings";
import { condition } from "./ui/condition";
import { byId } from "./ui/dom";
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

const PANEL_EVERY_MS = 100;
const SCENE_RETRY_MS = 1500;

export class App {
  private readonly tracks = new TrackLog();
  private readonly trackRate = new RateMeter();
  private readonly latency = new Recent();
  private readonly trackLatency = new Recent();
  private readonly link: Link;
  private readonly commands: Commands;
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
  private linkState: LinkState = { phase: "connecting", sentence: "", retryAtMs: null };
  private health: HealthMessage | null = null;
  private scene: SceneDescription | null = null;
  private sceneText = "";
  private lastTrackMs = performance.now();
  private lastPanelMs = 0;
  private handSteered = false;

  /** Throws Error when the browser gives no WebGL 2. */
  constructor(settings: Settings, private readonly errors: { readonly count: number }) {
    this.link = new Link(linkAddress(document.baseURI), {
      onState: (state) => this.takeLinkState(state),
      onHello: (hello) => this.takeHello(hello),
      onMessage: (message) => this.take(message),
    });
    this.commands = new Commands((message) => this.link.send(message));
    this.steering = new Steering((name, args) => this.commands.ask(name, args), (sentence) => toast(sentence, "bad"));
    this.stagecraft = new Stagecraft(byId<HTMLCanvasElement>("view"), settings);
    this.heart = new HeartLoader(this.stagecraft, settings);
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
    this.operator = new Operator(this.commands, (operating) => {
      this.keys.steering = operating && this.sliders.ready;
    });
    wireViews(this.stagecraft.presets);
    makeTabs(() => this.pictures.refresh());
  }

  start(): void {
    this.stagecraft.presets.go("iso", performance.now());
    this.link.start();
    addEventListener("online", () => this.link.start());
    requestAnimationFrame((now) => this.frame(now));
  }

  debugHandle(): DebugHandle {
    const app = this;
    return {
      get frames() { return app.stagecraft.view.frames; },
      drawn: () => app.stagecraft.drawn(),
      get status() { return byId("status").textContent ?? ""; },
      get link() { return app.linkState.phase; },
      get connections() { return app.link.connections; },
      get lastSeq() { return app.tracks.newest?.seq ?? -1; },
      get consoleErrors() { return app.errors.count; },
      get pixelRatio() { return app.stagecraft.view.pixelRatio; },
      get heartParts() { return app.stagecraft.heart.parts.length; },
      get role() { return app.operator.role; },
      pictures: () => app.pictures.panels.map(({ camera, shownSeq, overlaid }) => ({ camera, seq: shownSeq, overlaid })),
    };
  }

  // --- messages ---------------------------------------------------------------------------------------------------

  private take(message: ServerMessage): void {
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
    this.roll.leave();
    this.lastTrackMs = performance.now();
    this.operator.greet(hello);
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
    this.scene = scene;
    this.stagecraft.describe(scene);
    this.stagecraft.presets.go("iso", performance.now());
    this.pictures.describe(scene);
    byId("catheter-name").textContent = `${scene.catheter_name}, ⌀ ${scene.catheter_diameter_mm} mm`;
    if (scene.twin !== null) this.sliders.describe(scene.twin);
    this.operator.describe(scene);
    this.heart.offerLandmarks(scene.targets.length);
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
    requestAnimationFrame((next) => this.frame(next));
    this.keys.update(nowMs);
    this.pictures.update(nowMs);
    this.stagecraft.frame(nowMs, this.scene === null ? null : this.tracks.newest);
    if (nowMs - this.lastPanelMs >= PANEL_EVERY_MS) this.showPanels(nowMs);
  }

  private showPanels(nowMs: number): void {
    this.lastPanelMs = nowMs;
    const track = this.tracks.newest;
    const now = condition({
      link: this.linkState, track, trackAgeMs: nowMs - this.lastTrackMs, health: this.health, nowMs,
    });
    this.stage.show(now);
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

  private actions(): Actions {
    return {
      presets: this.stagecraft.presets,
      toggleHeart: () => this.heart.toggle(),
      toggleLandmarks: () => this.heart.toggleLandmarks(),
      toggleRecording: () => this.operator.toggleRecording(),
      togglePicture: (camera) => this.pictures.enlarge(this.pictures.enlarged === camera ? null : camera),
      closeAll: () => this.pictures.enlarge(null),
    };
  }
}

const SOURCES: Record<string, string> = { twin: "digital twin", cameras: "cameras", replay: "replay" };
