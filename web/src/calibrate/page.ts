/** The calibration page's program: the link's messages in, one kind of calibration on the screen. */

import type { EventMessage, Hello, ServerMessage } from "../generated/messages";
import { linkAddress } from "../link/address";
import { Commands } from "../link/commands";
import type { LinkState } from "../link/link";
import { Link } from "../link/link";
import { sentence, withUnits } from "../maths/format";
import { BannerView } from "../ui/banner";
import { linkCondition } from "../ui/condition";
import { byId, setText } from "../ui/dom";
import { wirePairing } from "../ui/pairing";
import { toast, toastEvent } from "../ui/toasts";
import { Actions } from "./actions";
import type { Calibration } from "./buttons";
import { offersFor } from "./buttons";
import { CamerasView } from "./cameras_view";
import type { Ending } from "./ending";
import { endingOf } from "./ending";
import { IntrinsicsView } from "./intrinsics_view";
import { MarkersView } from "./markers_view";
import { showFigures } from "./results";
import { RollView } from "./roll_view";
import { TouchView } from "./touch_view";
import type { View, ViewContext } from "./view";

const TICK_MS = 100;
/** What the space bar does. */
const CAPTURES: Partial<Record<Calibration["type"], string>> = {
  calibrate_intrinsics: "calibration_capture", calibrate_registration: "registration_take",
};

/** What tests and curious people can ask the page: `window.__cathxrCalibration`. */
export interface CalibrationHandle {
  readonly link: string;
  readonly connections: number;
  readonly role: string;
  readonly kind: string;
  readonly stage: string;
  readonly consoleErrors: number;
  shown(): Record<string, number>;
}

declare global {
  interface Window {
    __cathxrCalibration?: CalibrationHandle;
  }
}

export class CalibrationPage {
  private readonly link: Link;
  private readonly commands: Commands;
  private readonly actions: Actions;
  private readonly banner = new BannerView(() => this.link.start());
  private readonly views: Record<Calibration["type"], View<never>>;
  private linkState: LinkState = { phase: "connecting", sentence: "", retryAtMs: null };
  private state: Calibration | null = null;
  private role: Hello["role"] = "viewer";
  private needsPairing = false;
  private ending: Ending | null = null;

  constructor(picturesHz: number, private readonly errors: { readonly count: number }) {
    this.link = new Link(linkAddress(document.baseURI), {
      onState: (state) => this.takeLinkState(state),
      onHello: (hello) => this.takeHello(hello),
      onMessage: (message) => this.take(message),
    });
    this.commands = new Commands((message) => this.link.send(message));
    const context: ViewContext = {
      picturesHz,
      ask: (name, args) => this.commands.ask(name, args),
      refresh: () => this.refresh(),
    };
    this.views = {
      calibrate_intrinsics: new IntrinsicsView(context),
      calibrate_markers: new MarkersView(context),
      calibrate_cameras: new CamerasView(context),
      calibrate_roll: new RollView(),
      calibrate_registration: new TouchView(context),
    };
    this.actions = new Actions((name, args) => this.commands.ask(name, args), (command, result) => this.done(command, result));
    wirePairing(this.commands, () => {
      this.role = "operator";
      toast("Paired: this page may calibrate.");
      this.refresh();
    });
    addEventListener("online", () => this.link.start());
    addEventListener("keydown", (event) => this.key(event));
    document.addEventListener("visibilitychange", () => this.refresh());
  }

  start(): void {
    this.link.start();
    setInterval(() => this.tick(), TICK_MS);
  }

  handle(): CalibrationHandle {
    const page = this;
    return {
      get link() { return page.linkState.phase; },
      get connections() { return page.link.connections; },
      get role() { return page.role; },
      get kind() { return page.state?.type ?? ""; },
      get stage() { return page.state?.stage ?? ""; },
      get consoleErrors() { return page.errors.count; },
      shown: () => page.view?.shown() ?? {},
    };
  }

  private get view(): View<never> | null {
    return this.state === null ? null : this.views[this.state.type];
  }

  private get live(): boolean {
    return this.linkState.phase === "live";
  }

  // --- messages ---------------------------------------------------------------------------------------------------

  private take(message: ServerMessage): void {
    switch (message.type) {
      case "calibrate_intrinsics":
      case "calibrate_markers":
      case "calibrate_cameras":
      case "calibrate_roll":
      case "calibrate_registration":
        this.takeState(message);
        break;
      case "event":
        this.takeEvent(message);
        break;
      case "refusal":
        if (!this.commands.takeRefusal(message)) toast(message.sentence, "bad");
        break;
    }
  }

  private takeState(state: Calibration): void {
    if (this.state !== null && this.state.type !== state.type) this.view?.hide();
    this.state = state;
    this.view?.take(state as never);
    this.refresh();
  }

  private takeEvent(event: EventMessage): void {
    if (this.commands.takeEvent(event)) return;
    if (event.kind === "calibration_ended") this.end(endingOf(event.payload ?? {}));
    else toastEvent(event);
  }

  private takeLinkState(state: LinkState): void {
    const was = this.linkState.phase;
    this.linkState = state;
    if (was === "live" && state.phase !== "live") this.commands.abandon();
    this.refresh();
  }

  private takeHello(hello: Hello): void {
    this.role = hello.role;
    this.needsPairing = hello.needs_pairing;
    if (this.ending !== null) { // another run of the server: a calibration begins again
      this.ending = null;
      this.view?.hide();
      this.state = null;
    }
    this.refresh();
  }

  private done(command: string, result: Record<string, unknown>): void {
    if (command === "calibration_accept" || command === "calibration_cancel") this.end(endingOf(result));
  }

  private end(ending: Ending | null): void {
    if (ending === null) return;
    this.ending = ending;
    this.refresh();
  }

  // --- what is shown ----------------------------------------------------------------------------------------------

  private tick(): void {
    const now = performance.now();
    this.view?.tick(now);
    this.showLink(now);
    this.showCall();
  }

  private refresh(): void {
    const operating = this.live && this.role === "operator" && this.ending === null;
    this.view?.allow(operating, this.live && this.ending === null);
    document.body.dataset["kind"] = this.state?.type ?? "none";
    document.body.dataset["ended"] = String(this.ending !== null);
    const task = this.state === null ? "Calibration" : (this.view as View<Calibration>).title(this.state);
    setText(byId("task"), task);
    document.title = `${task} · cathxr`;
    byId("role").hidden = !(this.live && this.role === "viewer");
    byId("pairing").hidden = !(this.live && this.role === "viewer" && this.needsPairing);
    this.showResult();
    this.showEnding();
    this.actions.show(this.state === null || this.ending !== null ? [] : offersFor(this.state, this.viewing()));
    this.showLink(performance.now());
    this.showCall();
  }

  /** Returns why this page may not command; empty: it may. */
  private viewing(): string {
    if (!this.live) return "There is no link to the server.";
    if (this.role === "operator") return "";
    return this.needsPairing
      ? "Viewing only: enter the pairing code above to calibrate from here."
      : "Viewing only: calibrate from the computer on which the server runs.";
  }

  private showResult(): void {
    const figures = this.state?.figures ?? [];
    byId("figures-panel").hidden = figures.length === 0;
    setText(byId("figures-title"), this.state?.stage === "collecting" ? "So far" : "Result");
    showFigures(byId("figures"), figures);
  }

  private showCall(): void {
    const call = byId("call");
    if (this.state === null) {
      call.dataset["look"] = "idle";
      setText(byId("word"), "");
      setText(byId("advice"), this.live ? "The server runs no calibration." : "Waiting for the server.");
      return;
    }
    const { look, word } = (this.view as View<Calibration>).call(this.state);
    call.dataset["look"] = look;
    setText(byId("word"), word);
    setText(byId("advice"), withUnits(this.state.advice));
  }

  private showEnding(): void {
    byId("ended").hidden = this.ending === null;
    if (this.ending === null) return;
    byId("ended").dataset["saved"] = String(this.ending.saved);
    setText(byId("ended-title"), this.ending.title);
    setText(byId("ended-text"), sentence(this.ending.sentence));
  }

  private showLink(nowMs: number): void {
    const { phase } = this.linkState;
    const now = phase === "live" ? null : linkCondition(this.linkState, nowMs, this.state !== null);
    const status = byId("status");
    setText(status, this.ending !== null ? "finished" : now?.label ?? "connected");
    status.dataset["level"] = this.ending !== null ? "idle" : now?.level ?? "good";
    this.banner.show(this.ending !== null ? null : now?.banner ?? null);
    byId("work").dataset["stale"] = String(now?.stale ?? false);
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    const command = this.state === null ? undefined : CAPTURES[this.state.type];
    if (target.closest("input, button, dialog") !== null || command === undefined) return;
    if (event.key === " " || event.key.toLowerCase() === "c") {
      event.preventDefault();
      this.actions.press(command);
    }
  }
}
