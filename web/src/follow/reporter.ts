/** Tells the server what this page looks at, for those who follow it: after changes, at most ten times a second. */

import { Matrix4, Quaternion, Vector3 } from "three";
import type { Object3D } from "three";
import type { ViewReport } from "../generated/messages";
import type { SceneSettings } from "../stage/settings";

export const REPORT_EVERY_MS = 100;
/** Smaller movements of the head are not told: mm, and one minus the quaternions' product (0.03 degrees). */
const STILL_MM = 0.1;
const STILL_TURN = 4e-8;
const ONE = new Vector3(1, 1, 1);

/** Beside the settings: the step of the guide that the person is at. */
export const GUIDE_KEY = "guideStep";
const LONGEST_STEP = 120;

/** Returns what somebody's view says about the guide's step; empty for none, or for what cannot be believed. */
export function guideStepOf(settings: Readonly<Record<string, unknown>>): string {
  const step = settings[GUIDE_KEY];
  return typeof step === "string" && step.length <= LONGEST_STEP ? step : "";
}

/** Where the eyes and the scene are, as the View has them. */
export interface Eyes {
  readonly camera: Object3D;
  readonly box: Object3D;
  readonly immersive: boolean;
  /** A headset wearer's head in the scene; `camera` is but one of their eyes. */
  readonly head: { readonly position: Vector3; readonly orientation: Quaternion };
}

export class ViewReporter {
  private readonly boxFromHead = new Matrix4();
  private readonly sceneFromHead = new Matrix4();
  private readonly position = new Vector3();
  private readonly orientation = new Quaternion();
  private readonly scale = new Vector3();
  private readonly toldPosition = new Vector3(Infinity, 0, 0);
  private readonly toldOrientation = new Quaternion();
  private toldSettings: SceneSettings | null = null;
  private toldGuide = "";
  private toldKind: ViewReport["kind"] | null = null;
  private lastMs = -Infinity;

  /** world: what a headset's wearer moves about. send: returns whether there was a link to send it on. */
  constructor(
    private readonly eyes: Eyes,
    private readonly world: Object3D,
    private readonly send: (report: ViewReport) => boolean,
  ) {}

  /** Tells everything anew: the server does not know this page yet. */
  forget(): void {
    this.toldSettings = null;
    this.toldKind = null;
  }

  /** Called once for each frame. guide: the step of the guide that is shown, in words; empty while none is. */
  update(nowMs: number, settings: SceneSettings, guide = ""): void {
    if (nowMs - this.lastMs < REPORT_EVERY_MS) return;
    const { camera, box, immersive, head } = this.eyes;
    const kind = immersive || isHeadsetBrowser(navigator.userAgent) ? "headset" : "desktop";
    camera.updateWorldMatrix(true, false);
    box.updateWorldMatrix(true, false);
    const sceneFromHead = immersive ? this.sceneFromHead.compose(head.position, head.orientation, ONE) : camera.matrixWorld;
    this.boxFromHead.copy(box.matrixWorld).invert().multiply(sceneFromHead);
    this.boxFromHead.decompose(this.position, this.orientation, this.scale);
    const still = this.position.distanceTo(this.toldPosition) < STILL_MM
      && 1 - Math.abs(this.orientation.dot(this.toldOrientation)) < STILL_TURN;
    if (still && settings === this.toldSettings && kind === this.toldKind && guide === this.toldGuide) return;
    this.lastMs = nowMs;
    if (!this.send(this.report(kind, settings, guide))) return;
    this.toldPosition.copy(this.position);
    this.toldOrientation.copy(this.orientation);
    this.toldSettings = settings;
    this.toldKind = kind;
    this.toldGuide = guide;
  }

  private report(kind: ViewReport["kind"], settings: SceneSettings, guide: string): ViewReport {
    const { position: p, orientation: q, world } = this;
    return {
      type: "view",
      kind,
      settings: { ...settings, [GUIDE_KEY]: guide },
      head: {
        position_mm: [rounded(p.x, 3), rounded(p.y, 3), rounded(p.z, 3)],
        orientation_wxyz: [rounded(q.w, 6), rounded(q.x, 6), rounded(q.y, 6), rounded(q.z, 6)],
      },
      world: !this.eyes.immersive ? null : {
        position_m: [rounded(world.position.x, 5), rounded(world.position.y, 5), rounded(world.position.z, 5)],
        orientation_wxyz: [
          rounded(world.quaternion.w, 6), rounded(world.quaternion.x, 6), rounded(world.quaternion.y, 6), rounded(world.quaternion.z, 6),
        ],
        scale: rounded(world.scale.x, 5),
      },
    };
  }
}

/** Returns whether a browser runs inside a headset, by what it says of itself. */
export function isHeadsetBrowser(userAgent: string): boolean {
  return /OculusBrowser|Quest|PicoBrowser|Pico Neo|Wolvic|VisionOS|Apple Vision|Vive/i.test(userAgent);
}

function rounded(value: number, decimals: number): number {
  return Number(value.toFixed(decimals));
}
