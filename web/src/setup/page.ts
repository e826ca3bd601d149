/** The page that walks through the set-up: both pictures live, every check with what to do. */

import { LivePicture } from "../calibrate/live_picture";
import type { Hello, ServerMessage, SetupState } from "../generated/messages";
import { linkAddress } from "../link/address";
import { Commands } from "../link/commands";
import type { LinkState } from "../link/link";
import { Link } from "../link/link";
import { BannerView } from "../ui/banner";
import { linkCondition } from "../ui/condition";
import { byId, setText } from "../ui/dom";
import { wirePairing } from "../ui/pairing";
import { toast } from "../ui/toasts";
import { stepsOf, summary } from "./steps";
import { showSteps } from "./steps_view";

/** How often what costs nothing is asked again: rates, encoder, network, headset. */
const QUICK_MS = 2000;
const AGAIN_MS = 4000;
const TICK_MS = 250;
const MOST_HZ = 10;

/** What tests and curious people can ask the page: `window.__cathxrSetup`. */
export interface SetupHandle {
  readonly link: string;
  readonly role: string;
  readonly busy: boolean;
  readonly consoleErrors: number;
  verdicts(): Record<string, string>;
  shown(): Record<string, number>;
}

declare global {
  interface Window {
    __cathxrSetup?: SetupHandle;
  }
}

export class SetupPage {
  private readonly link: Link;
  private readonly commands: Commands;
  private readonly banner = new BannerView(() => this.link.start());
  private readonly pictures = new Map<string, LivePicture>();
  private linkState: LinkState = { phase: "connecting", sentence: "", retryAtMs: null };
  private role: Hello["role"] = "viewer";
  private needsPairing = false;
  private state: SetupState | null = null;
  private refusal = "";
  private hasLooked = false;
  private quickAtMs = 0;
  private lookedAtMs = 0;

  constructor(picturesHz: number, private readonly errors: { readonly count: number }) {
    this.link = new Link(linkAddress(document.baseURI), {
      onState: (state) => this.takeLinkState(state),
      onHello: (hello) => this.takeHello(hello),
      onMessage: (message) => this.take(message),
    });
    this.commands = new Commands((message) => this.link.send(message));
    for (const figure of document.querySelectorAll<HTMLElement>(".shot")) this.addPicture(figure, picturesHz);
    wirePairing(this.commands, () => {
      this.role = "operator";
      toast("Paired: this page may check the set-up.");
      this.look();
    });
    byId("again").addEventListener("click", () => this.look());
    for (const button of byId("ask").querySelectorAll("button")) {
      button.addEventListener("click", () => void this.ask({ pictures: false, said: button.dataset["said"] ?? "" }));
    }
    addEventListener("online", () => this.link.start());
    document.addEventListener("visibilitychange", () => this.refresh());
  }

  start(): void {
    this.link.start();
    setInterval(() => this.tick(), TICK_MS);
  }

  handle(): SetupHandle {
    const page = this;
    return {
      get link() { return page.linkState.phase; },
      get role() { return page.role; },
      get busy() { return page.state?.busy ?? true; },
      get consoleErrors() { return page.errors.count; },
      verdicts: () => Object.fromEntries((page.state?.checks ?? []).map((each) => [each.title, each.verdict])),
      shown: () => Object.fromEntries([...page.pictures].map(([name, picture]) => [name, picture.shownSeq])),
    };
  }

  private get operating(): boolean {
    return this.linkState.phase === "live" && this.role === "operator";
  }

  private addPicture(figure: HTMLElement, picturesHz: number): void {
    const camera = figure.dataset["camera"] ?? "";
    const picture: LivePicture = new LivePicture({
      camera, canvas: figure.querySelector("canvas")!, note: figure.querySelector<HTMLElement>(".note")!,
      picturesHz: Math.min(MOST_HZ, picturesHz), full: false,
      overlay: ({ bitmap }) => {
        if (bitmap !== null) picture.describe({ width: bitmap.width, height: bitmap.height });
      },
    });
    this.pictures.set(camera, picture);
  }

  // --- messages -----------------------------------------------------------------------------------------------------

  private take(message: ServerMessage): void {
    if (message.type === "setup") {
      this.state = message;
      this.refresh();
    } else if (message.type === "event") {
      this.commands.takeEvent(message);
    } else if (message.type === "refusal" && !this.commands.takeRefusal(message)) {
      toast(message.sentence, "bad");
    }
  }

  private takeHello(hello: Hello): void {
    this.role = hello.role;
    this.needsPairing = hello.needs_pairing;
    this.refusal = "";
    this.hasLooked = false;
    this.refresh();
  }

  private takeLinkState(state: LinkState): void {
    const was = this.linkState.phase;
    this.linkState = state;
    if (was === "live" && state.phase !== "live") this.commands.abandon();
    this.refresh();
  }

  /** Returns whether the pictures have not come that were to be looked at, as while a system starts. */
  private sawNothing(nowMs: number): boolean {
    const measured = this.state?.checks.some((each) => each.t !== null && each.subject !== "which") ?? false;
    return !measured && this.state?.busy === false && nowMs - this.lookedAtMs > AGAIN_MS;
  }

  private look(): void {
    this.hasLooked = true;
    this.lookedAtMs = performance.now();
    void this.ask({});
  }

  private async ask(args: Record<string, unknown>): Promise<void> {
    const answer = await this.commands.ask("setup_check", args);
    this.refusal = answer.done ? "" : answer.sentence;
    this.refresh();
  }

  // --- what is shown ------------------------------------------------------------------------------------------------

  private tick(): void {
    const now = performance.now();
    if (this.operating && !document.hidden && this.refusal === "") {
      if (!this.hasLooked || this.sawNothing(now)) this.look();
      else if (now - this.quickAtMs > QUICK_MS && this.state?.busy === false) void this.ask({ pictures: false });
      else return this.showLink(now);
      this.quickAtMs = now;
    }
    this.showLink(now);
  }

  private refresh(): void {
    const live = this.linkState.phase === "live";
    for (const picture of this.pictures.values()) picture.setActive(live && !document.hidden);
    byId("role").hidden = !(live && this.role === "viewer");
    byId("pairing").hidden = !(live && this.role === "viewer" && this.needsPairing);
    byId<HTMLButtonElement>("again").disabled = !this.operating || this.state?.busy === true;
    const steps = stepsOf(this.state?.checks ?? []);
    for (const button of byId("ask").querySelectorAll("button")) button.disabled = !this.operating;
    showSteps(byId("steps"), steps, this.state?.t ?? 0, byId("ask"));
    setText(byId("verdict"), this.sentence(steps.length > 0 ? summary(steps) : ""));
    this.showLink(performance.now());
  }

  private sentence(found: string): string {
    if (this.linkState.phase !== "live") return "Waiting for the server.";
    if (this.refusal !== "") return this.refusal;
    if (this.state?.busy === true) return "Looking at both pictures …";
    if (found !== "") return found;
    return this.role === "viewer" ? "Nobody has checked yet: an operator can." : "Looking …";
  }

  private showLink(nowMs: number): void {
    const now = this.linkState.phase === "live" ? null : linkCondition(this.linkState, nowMs, this.state !== null);
    const status = byId("status");
    setText(status, now?.label ?? "connected");
    status.dataset["level"] = now?.level ?? "good";
    this.banner.show(now?.banner ?? null);
    byId("work").dataset["stale"] = String(now?.stale ?? false);
  }
}
