/** What the hands do: press and move plates, or hold the world. The same for controllers and bare hands. */

import { Matrix4, Quaternion, Vector3 } from "three";
import type { Plate } from "../flat/plate";
import type { Grab } from "./grab";
import type { Hit } from "./hits";
import { castFinger, castRay, makeHit } from "./hits";
import type { Head } from "./placement";
import type { Pointer, PressKind } from "./pointer";

/** A finger presses when it goes through the plate and lets go when it is out again: not twice on its way. */
const TOUCH_PRESS_M = 0.002;
const TOUCH_RELEASE_M = 0.015;
const FACING_S = 0.12;
const UP = new Vector3(0, 1, 0);

type Doing = "nothing" | "pressing" | "moving" | "grabbing";

/** One hand's state. */
class Hand {
  readonly hit: Hit = makeHit();
  doing: Doing = "nothing";
  kind: PressKind | "touch" = "select";
  plate: Plate | null = null;
  /** How far along the ray the moved plate's centre is, and its offset from the ray there. */
  readonly offset = new Vector3();

  constructor(readonly pointer: Pointer) {}
}

const work = {
  place: new Vector3(), turn: new Quaternion(), inverse: new Quaternion(), matrix: new Matrix4(), hit: makeHit(),
};

export class Interaction {
  private readonly hands: readonly [Hand, Hand];
  private nowMs = 0;

  constructor(
    pointers: readonly [Pointer, Pointer],
    private readonly grab: Grab,
    private readonly plates: () => readonly Plate[],
    /** Called when a plate is moved by hand: it is where its viewer wants it. */
    private readonly onMoved: (plate: Plate) => void,
  ) {
    this.hands = [new Hand(pointers[0]), new Hand(pointers[1])];
  }

  /** What each hand points at: for the rays and cursors. */
  hitOf(pointer: Pointer): Hit {
    return this.handOf(pointer).hit;
  }

  /** Whether a hand is holding the world. */
  grabs(pointer: Pointer): boolean {
    return this.handOf(pointer).doing === "grabbing";
  }

  /** Whether a hand is neither holding anything nor pointing at a plate. */
  free(pointer: Pointer): boolean {
    const hand = this.handOf(pointer);
    return hand.doing === "nothing" && hand.hit.plate === null;
  }

  press(pointer: Pointer, kind: PressKind): void {
    const hand = this.handOf(pointer);
    if (hand.doing !== "nothing" || !pointer.tracked) return;
    hand.kind = kind;
    this.aim(hand); // events come between frames: the last frame's aim may be of another plate
    const { plate } = hand.hit;
    if (plate === null) {
      if (kind === "squeeze" || pointer.bare) this.beginGrab(hand);
    } else if (kind === "select" && plate.pointer?.(hand.hit.u, hand.hit.v, "press") === true) {
      hand.doing = "pressing";
      hand.plate = plate;
      pointer.tap(0.35, 12);
    } else {
      this.beginMove(hand, plate);
    }
  }

  release(pointer: Pointer, kind: PressKind): void {
    const hand = this.handOf(pointer);
    if (hand.kind === kind) this.end(hand);
  }

  /** A hand went out of sight, or its controller was put down. */
  lose(pointer: Pointer): void {
    const hand = this.handOf(pointer);
    this.end(hand);
    hand.hit.plate = null;
  }

  /** Called once a frame, after the pointers are up to date. head: where the viewer is. */
  update(nowMs: number, dtS: number, head: Head): void {
    this.nowMs = nowMs;
    for (const hand of this.hands) {
      if (!hand.pointer.tracked) {
        if (hand.doing !== "nothing") this.end(hand);
        hand.hit.plate = null;
        continue;
      }
      if (hand.doing === "grabbing") continue;
      if (hand.doing === "moving") {
        this.move(hand, dtS, head);
        continue;
      }
      this.aim(hand);
      this.touch(hand);
      this.tell(hand);
    }
  }

  /** Lets go of everything, as at a session's end. */
  reset(): void {
    for (const hand of this.hands) this.lose(hand.pointer);
    this.grab.releaseAll();
  }

  private handOf(pointer: Pointer): Hand {
    return this.hands[0].pointer === pointer ? this.hands[0] : this.hands[1];
  }

  private aim(hand: Hand): void {
    const { pointer, hit } = hand;
    const plates = this.plates();
    if (pointer.bare) {
      castFinger(hit, plates, pointer.fingertip, hand.kind === "touch" ? hand.plate : null);
      if (hit.plate !== null) return;
    }
    castRay(hit, plates, pointer.origin, pointer.direction);
  }

  /** Lets a fingertip press what it goes through. */
  private touch(hand: Hand): void {
    const { hit } = hand;
    if (hand.doing === "nothing") {
      if (!hit.touching || hit.plate === null || hit.distance > TOUCH_PRESS_M) return;
      if (hit.plate.pointer?.(hit.u, hit.v, "press") !== true) return;
      hand.doing = "pressing";
      hand.kind = "touch";
      hand.plate = hit.plate;
    } else if (hand.kind === "touch" && (hit.plate !== hand.plate || !hit.touching || hit.distance > TOUCH_RELEASE_M)) {
      this.end(hand);
    }
  }

  private tell(hand: Hand): void {
    const { hit, plate } = hand;
    if (hand.doing === "pressing") {
      if (hit.plate === plate) plate!.pointer!(hit.u, hit.v, "drag");
    } else {
      hit.plate?.pointer?.(hit.u, hit.v, "move");
    }
  }

  private beginGrab(hand: Hand): void {
    this.grab.take(hand.pointer);
    hand.doing = "grabbing";
    hand.pointer.tap(0.2, 10);
  }

  private beginMove(hand: Hand, plate: Plate): void {
    hand.doing = "moving";
    hand.plate = plate;
    hand.hit.plate = plate;
    work.place.setFromMatrixPosition(plate.group.matrixWorld);
    hand.offset.copy(work.place).sub(hand.pointer.origin).applyQuaternion(work.inverse.copy(hand.pointer.ray.quaternion).conjugate());
  }

  /** Carries a plate on the ray, turned to its viewer little by little. */
  private move(hand: Hand, dtS: number, head: Head): void {
    const { pointer } = hand;
    const { group } = hand.plate!;
    const place = work.place.copy(hand.offset).applyQuaternion(pointer.ray.quaternion).add(pointer.origin);
    facing(work.turn, place, head.position);
    if (group.parent !== null) {
      group.parent.worldToLocal(place);
      work.turn.premultiply(group.parent.getWorldQuaternion(work.inverse).conjugate());
    }
    group.position.copy(place);
    group.quaternion.slerp(work.turn, 1 - Math.exp(-dtS / FACING_S));
    group.updateMatrixWorld(true);
    this.onMoved(hand.plate!);
    castRay(work.hit, this.plates(), pointer.origin, pointer.direction);
    if (work.hit.plate === hand.plate) hand.hit.point.copy(work.hit.point);
  }

  private end(hand: Hand): void {
    const { doing, plate, hit } = hand;
    hand.doing = "nothing";
    hand.plate = null;
    if (doing === "grabbing") this.grab.release(hand.pointer, this.nowMs);
    if (doing === "pressing") plate?.pointer?.(hit.u, hit.v, "release");
    hand.kind = "select";
  }
}

/** Writes the turn of a plate at `place` that faces somebody's eyes, its lower edge level. */
export function facing(out: Quaternion, place: Vector3, eyes: Vector3): Quaternion {
  work.matrix.lookAt(eyes, place, UP); // three's lookAt for cameras: +z from the place towards the eyes
  return out.setFromRotationMatrix(work.matrix);
}
