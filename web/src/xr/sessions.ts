/** A headset's sessions: begun, watched, ended, and what to say when one cannot be had. */

import type { View } from "../scene/view";

export type XrMode = "vr" | "ar";

/** blurred: the headset's own menu is over the scene; hidden: its wearer does not see the scene at all. */
export type XrPhase = "none" | "starting" | "running" | "blurred" | "hidden";

export interface XrState {
  readonly mode: XrMode | null;
  readonly phase: XrPhase;
}

export interface XrQuality {
  /** Pixels of a picture over what the headset recommends, in each direction. */
  readonly scale: number;
  /** 0 (sharp everywhere) to 1 (as coarse towards the edges as the headset can). */
  readonly foveation: number;
}

const SESSION: Readonly<Record<XrMode, XRSessionMode>> = { vr: "immersive-vr", ar: "immersive-ar" };
const NAME: Readonly<Record<XrMode, string>> = { vr: "VR", ar: "AR (seeing the room)" };
const OPTIONAL = ["hand-tracking", "bounded-floor"];
const RATE_HZ = 90;

export class XrSessions {
  /** Called whenever the state or what is supported changes; also once a session's wearer puts the origin elsewhere. */
  onChange: (state: XrState) => void = () => undefined;
  onRecentred: () => void = () => undefined;
  private now: XrState = { mode: null, phase: "none" };
  private offered: Partial<Record<XrMode, boolean>> = {};
  private asked = false;

  constructor(private readonly view: View, private readonly quality: XrQuality) {
    const { xr } = this.view.renderer;
    xr.setReferenceSpaceType("local-floor");
    xr.addEventListener("sessionstart", () => this.view.immerse(this.now.mode === "ar")); // before the first picture
    xr.addEventListener("sessionend", () => this.ended());
    void this.look();
    navigator.xr?.addEventListener("devicechange", () => void this.look());
  }

  get state(): XrState {
    return this.now;
  }

  /** Pictures a second that the headset shows; null where it does not say. */
  get rateHz(): number | null {
    return this.view.renderer.xr.getSession()?.frameRate ?? null;
  }

  /** Returns why a session of this kind cannot be had, as a sentence; null where it can. */
  whyNot(mode: XrMode): string | null {
    if (!isSecureContext) return "A headset's browser allows this only over https, or through a cable at http://localhost.";
    if (navigator.xr === undefined) return "This browser has no WebXR: open this page in the headset's own browser.";
    if (!this.asked) return "Looking for a headset …";
    return this.offered[mode] === true ? null : `No headset that shows ${NAME[mode]} is connected to this browser.`;
  }

  /** Begins a session; to be called in answer to a press of a button. Throws Error with a sentence when it cannot. */
  async enter(mode: XrMode): Promise<void> {
    if (this.now.phase !== "none") return;
    const reason = this.whyNot(mode);
    if (reason !== null && this.asked) throw new Error(reason);
    if (navigator.xr === undefined) throw new Error(reason ?? "This browser has no WebXR.");
    this.tell({ mode, phase: "starting" });
    try {
      const session = await navigator.xr.requestSession(SESSION[mode], {
        requiredFeatures: ["local-floor"], optionalFeatures: OPTIONAL,
      });
      await this.begin(session, mode);
    } catch (error) {
      this.tell({ mode: null, phase: "none" });
      throw new Error(refusalSentence(error, mode), { cause: error });
    }
  }

  leave(): void {
    void this.view.renderer.xr.getSession()?.end().catch(() => undefined);
  }

  private async begin(session: XRSession, mode: XrMode): Promise<void> {
    const { xr } = this.view.renderer;
    session.addEventListener("visibilitychange", () => this.tell({ mode, phase: phaseOf(session) }));
    xr.setFramebufferScaleFactor(this.quality.scale);
    try {
      await xr.setSession(session);
    } catch (error) {
      void session.end().catch(() => undefined);
      throw error;
    }
    xr.setFoveation(this.quality.foveation);
    xr.getReferenceSpace()?.addEventListener("reset", () => this.onRecentred());
    void aimFor(session, RATE_HZ);
    this.tell({ mode, phase: phaseOf(session) });
  }

  /** However it ended: by the wearer, by the page, or because the headset went away. */
  private ended(): void {
    if (this.view.immersive) this.view.emerge();
    this.tell({ mode: null, phase: "none" });
    void this.look();
  }

  private async look(): Promise<void> {
    for (const mode of ["vr", "ar"] as const) {
      this.offered[mode] = await navigator.xr?.isSessionSupported(SESSION[mode]).catch(() => false) ?? false;
    }
    this.asked = true;
    this.onChange(this.now);
  }

  private tell(state: XrState): void {
    this.now = state;
    this.onChange(state);
  }
}

function phaseOf(session: XRSession): XrPhase {
  if (session.visibilityState === "visible-blurred") return "blurred";
  return session.visibilityState === "hidden" ? "hidden" : "running";
}

/** Asks for the rate nearest to the one wanted; a headset without a choice keeps its own. */
async function aimFor(session: XRSession, hz: number): Promise<void> {
  const rates = session.supportedFrameRates;
  if (rates === undefined || rates.length === 0 || session.updateTargetFrameRate === undefined) return;
  const nearest = rates.reduce((best, rate) => (Math.abs(rate - hz) < Math.abs(best - hz) ? rate : best));
  await session.updateTargetFrameRate(nearest).catch(() => undefined);
}

function refusalSentence(error: unknown, mode: XrMode): string {
  const name = error instanceof DOMException ? error.name : "";
  if (name === "SecurityError") return `The browser wants ${NAME[mode]} to be asked for by the press of a button: press it again.`;
  if (name === "InvalidStateError") return "Another page is using the headset: close it there and try again.";
  if (name === "NotSupportedError") return `This headset does not offer ${NAME[mode]} with a known floor: set its boundary up and try again.`;
  return `${NAME[mode]} could not be started (${error instanceof Error ? error.message : String(error)}).`;
}
