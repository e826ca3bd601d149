/** One of the viewer's two hands, with a controller in it or bare: where it points, where it holds, what it presses. */

import type { WebXRManager, XRGripSpace, XRHandSpace, XRTargetRaySpace } from "three";
import { Quaternion, Vector3 } from "three";
import type { Holder } from "./grab";

/** Hands are seen by cameras and shake by a millimetre; controllers do not. */
const HAND_SMOOTHING_S = 0.03;

export type PressKind = "select" | "squeeze";

export interface PointerHandlers {
  onPress(pointer: Pointer, kind: PressKind): void;
  onRelease(pointer: Pointer, kind: PressKind): void;
  onLost(pointer: Pointer): void;
}

export class Pointer implements Holder {
  /** What it holds with: a controller's grip, or the pinch between thumb and index finger; metres, the room's frame. */
  readonly position = new Vector3();
  readonly orientation = new Quaternion();
  readonly origin = new Vector3();
  readonly direction = new Vector3(0, 0, -1);
  /** The index finger's tip; only of a bare hand. */
  readonly fingertip = new Vector3();
  /** The system's own, steadied. */
  readonly ray: XRTargetRaySpace;
  readonly grip: XRGripSpace;
  readonly hand: XRHandSpace;
  source: XRInputSource | null = null;
  selecting = false;
  squeezing = false;
  private fresh = true;

  constructor(xr: WebXRManager, index: number, private readonly handlers: PointerHandlers) {
    this.ray = xr.getController(index);
    this.grip = xr.getControllerGrip(index);
    this.hand = xr.getHand(index);
    this.listen();
  }

  get tracked(): boolean {
    return this.source !== null && this.ray.visible;
  }

  get bare(): boolean {
    return this.source?.hand != null;
  }

  get left(): boolean {
    return this.source?.handedness === "left";
  }

  /** Reads this frame's poses; the groups' own have been set already. dtS: since the last frame. */
  update(dtS: number): void {
    if (!this.tracked) {
      this.fresh = true;
      return;
    }
    this.origin.copy(this.ray.position);
    this.direction.set(0, 0, -1).applyQuaternion(this.ray.quaternion);
    if (this.bare) this.readHand(dtS);
    else {
      const held = this.grip.visible ? this.grip : this.ray;
      this.position.copy(held.position);
      this.orientation.copy(held.quaternion);
    }
    this.fresh = false;
  }

  /** Whether a button of the controller is down; numbers as in the xr-standard mapping. */
  button(index: number): boolean {
    return this.source?.gamepad?.buttons[index]?.pressed ?? false;
  }

  /** Taps the hand that holds the controller. */
  tap(strength: number, ms: number): void {
    const actuator = (this.source?.gamepad as GamepadWithHaptics | undefined)?.hapticActuators?.[0];
    void actuator?.pulse?.(strength, ms)?.catch(() => undefined);
  }

  private readHand(dtS: number): void {
    const { joints } = this.hand;
    const index = joints["index-finger-tip"];
    const thumb = joints["thumb-tip"];
    const wrist = joints["wrist"];
    if (index === undefined || thumb === undefined || wrist === undefined) return;
    this.fingertip.copy(index.position);
    const share = this.fresh ? 1 : 1 - Math.exp(-dtS / HAND_SMOOTHING_S);
    middle.addVectors(index.position, thumb.position).multiplyScalar(0.5);
    this.position.lerp(middle, share);
    this.orientation.slerp(wrist.quaternion, share);
  }

  private listen(): void {
    this.ray.addEventListener("connected", ({ data }) => {
      this.source = data;
      this.fresh = true;
    });
    this.ray.addEventListener("disconnected", () => {
      this.source = null;
      this.selecting = this.squeezing = false;
      this.handlers.onLost(this);
    });
    this.ray.addEventListener("selectstart", () => this.press("select", true));
    this.ray.addEventListener("selectend", () => this.press("select", false));
    this.ray.addEventListener("squeezestart", () => this.press("squeeze", true));
    this.ray.addEventListener("squeezeend", () => this.press("squeeze", false));
  }

  private press(kind: PressKind, down: boolean): void {
    if (kind === "squeeze" && this.bare) return; // what a bare hand has is the pinch
    if (kind === "select") this.selecting = down;
    else this.squeezing = down;
    if (down) this.handlers.onPress(this, kind);
    else this.handlers.onRelease(this, kind);
  }
}

const middle = new Vector3();

interface GamepadWithHaptics {
  readonly hapticActuators?: readonly { pulse?(value: number, ms: number): Promise<unknown> | undefined }[];
}
