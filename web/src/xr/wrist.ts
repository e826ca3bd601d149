/** The button at the left wrist that opens the menu: there while the palm is turned to the face. */

import { Quaternion, Vector3 } from "three";
import type { PointerPhase } from "../flat/plate";
import { box, CanvasPlate, INK, write } from "./canvas_plate";
import { facing } from "./interaction";
import type { Head } from "./placement";
import type { Pointer } from "./pointer";

const WIDTH = 74;
const HEIGHT = 36;
/** Comes when the palm faces the eyes this well, and goes when it does no longer. */
const COMES = 0.72;
const GOES = 0.5;
const work = { palm: new Vector3(), way: new Vector3(), turn: new Quaternion() };

export class WristButton extends CanvasPlate {
  constructor(private readonly onPress: () => void) {
    super("wrist", WIDTH, HEIGHT, 3);
    this.redraw();
  }

  /** Called once a frame while a session runs. */
  update(pointers: readonly Pointer[], head: Head): void {
    let wrist = null;
    for (const pointer of pointers) {
      if (pointer.tracked && pointer.bare && pointer.left) wrist = pointer.hand.joints.wrist ?? null;
    }
    if (wrist === null || !wrist.visible) {
      this.group.visible = false;
      return;
    }
    work.palm.set(0, -1, 0).applyQuaternion(wrist.quaternion);
    work.way.subVectors(head.position, wrist.position).normalize();
    this.group.visible = work.palm.dot(work.way) > (this.visible ? GOES : COMES);
    if (!this.visible) return;
    this.group.position.copy(wrist.position).addScaledVector(work.way, 0.03);
    this.group.quaternion.copy(facing(work.turn, this.group.position, head.position));
    this.group.updateMatrixWorld(true);
  }

  pointer(_u: number, _v: number, phase: PointerPhase): boolean {
    if (phase === "press") this.onPress();
    return true;
  }

  protected paint(context: CanvasRenderingContext2D): void {
    const whole = { x: 0, y: 0, w: WIDTH, h: HEIGHT };
    box(context, whole, 12, INK.accent);
    write(context, "Menu", whole, 19, INK.onAccent, "center", 650);
  }
}
