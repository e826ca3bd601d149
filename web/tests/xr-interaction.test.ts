import { Group, Quaternion, Scene, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { Plate, PointerPhase } from "../src/flat/plate";
import { Grab } from "../src/xr/grab";
import { castFinger, castRay, makeHit } from "../src/xr/hits";
import { facing, Interaction } from "../src/xr/interaction";
import type { Pointer } from "../src/xr/pointer";

const HEAD = { position: new Vector3(0, 1.6, 0), orientation: new Quaternion() };

/** A plate of 0.4 m by 0.2 m, 0.6 m before the eyes, that has a use for its left half only. */
class Told implements Plate {
  readonly group = new Group();
  readonly widthM = 0.4;
  readonly heightM = 0.2;
  readonly title = "told";
  readonly heard: string[] = [];

  constructor(scene: Scene, z = -0.6) {
    this.group.position.set(0, 1.6, z);
    scene.add(this.group);
    scene.updateMatrixWorld(true);
  }

  pointer(u: number, v: number, phase: PointerPhase): boolean {
    if (phase !== "move") this.heard.push(`${phase} ${u.toFixed(2)} ${v.toFixed(2)}`);
    return u < 0.5;
  }
}

interface Told3 { pointer: Pointer; set(position: Vector3, target: Vector3): void }

function makePointer(bare: boolean): Told3 {
  const ray = new Group();
  const fake = {
    position: new Vector3(), orientation: new Quaternion(), origin: new Vector3(), direction: new Vector3(0, 0, -1),
    fingertip: new Vector3(0, 0, 5), ray, tracked: true, bare, selecting: false, tap: () => undefined,
  };
  return {
    pointer: fake as unknown as Pointer,
    set(position, target) {
      fake.origin.copy(position);
      fake.position.copy(position);
      fake.direction.subVectors(target, position).normalize();
      ray.position.copy(position);
      ray.quaternion.setFromUnitVectors(new Vector3(0, 0, -1), fake.direction);
    },
  };
}

function stage(bare: boolean): { plate: Told; hand: Told3; interaction: Interaction; grab: Grab } {
  const scene = new Scene();
  const plate = new Told(scene);
  const hand = makePointer(bare);
  const grab = new Grab();
  const other = makePointer(bare);
  other.set(new Vector3(0, 0, 9), new Vector3(0, 0, 10));
  const interaction = new Interaction([hand.pointer, other.pointer], grab, () => [plate], () => undefined);
  return { plate, hand, interaction, grab };
}

describe("hits", () => {
  it("are of the nearest plate's front, where the ray goes through it", () => {
    const scene = new Scene();
    const [far, near] = [new Told(scene, -0.9), new Told(scene, -0.6)];
    const hit = castRay(makeHit(), [far, near], new Vector3(0, 1.6, 0), new Vector3(0.1, 0.05, -0.6).normalize());
    expect(hit.plate).toBe(near);
    expect(hit.u).toBeCloseTo(0.75, 9);
    expect(hit.v).toBeCloseTo(0.75, 9);
    expect(hit.point.distanceTo(new Vector3(0.1, 1.65, -0.6))).toBeLessThan(1e-9);
    expect(castRay(hit, [far, near], new Vector3(0, 1.6, -2), new Vector3(0, 0, 1)).plate).toBeNull();
    near.group.visible = false;
    expect(castRay(hit, [far, near], new Vector3(0, 1.6, 0), new Vector3(0, 0, -1)).plate).toBe(far);
    scene.remove(far.group);
    expect(castRay(hit, [far], new Vector3(0, 1.6, 0), new Vector3(0, 0, -1)).plate).toBeNull();
  });

  it("know how far a fingertip is before a scaled and turned plate", () => {
    const scene = new Scene();
    const plate = new Told(scene);
    plate.group.scale.setScalar(2);
    plate.group.quaternion.setFromAxisAngle(new Vector3(0, 1, 0), Math.PI / 2);
    scene.updateMatrixWorld(true);
    const hit = castFinger(makeHit(), [plate], new Vector3(0.03, 1.7, -0.8), null);
    expect(hit.plate).toBe(plate);
    expect(hit.distance).toBeCloseTo(0.03, 9);
    expect(hit.u).toBeCloseTo(0.5 + 0.2 / 0.8, 9);
    expect(hit.v).toBeCloseTo(0.5 + 0.1 / 0.4, 9);
  });
});

describe("interaction", () => {
  it("presses what a plate has a use for, at the first press", () => {
    for (const bare of [false, true]) {
      const { plate, hand, interaction, grab } = stage(bare);
      hand.set(new Vector3(0.2, 1.3, -0.1), new Vector3(-0.1, 1.6, -0.6));
      interaction.update(0, 0.01, HEAD);
      interaction.press(hand.pointer, "select");
      hand.set(new Vector3(0.2, 1.3, -0.1), new Vector3(-0.08, 1.6, -0.6));
      interaction.update(11, 0.01, HEAD);
      interaction.release(hand.pointer, "select");
      expect(plate.heard).toEqual(["press 0.25 0.50", "drag 0.30 0.50", "release 0.30 0.50"]);
      expect(grab.hands).toBe(0);
    }
  });

  it("moves a plate by where it has no use for the press, without a jump, and keeps it facing its viewer", () => {
    const { plate, hand, interaction } = stage(false);
    const at = new Vector3(0.1, 1.6, -0.6);
    hand.set(new Vector3(0.2, 1.3, -0.1), at);
    interaction.update(0, 0.01, HEAD);
    interaction.press(hand.pointer, "select");
    interaction.update(10, 0.01, HEAD);
    expect(plate.group.position.distanceTo(new Vector3(0, 1.6, -0.6))).toBeLessThan(1e-9);
    hand.set(new Vector3(0.5, 1.3, -0.1), at.clone().add(new Vector3(0.3, 0, 0)));
    for (let step = 0; step < 200; step++) interaction.update(20 + step, 0.01, HEAD);
    expect(plate.group.position.distanceTo(new Vector3(0.3, 1.6, -0.6))).toBeLessThan(1e-6);
    const facingHead = facing(new Quaternion(), plate.group.position, HEAD.position);
    expect(plate.group.quaternion.angleTo(facingHead)).toBeLessThan(1e-3);
    interaction.release(hand.pointer, "select");
    hand.set(new Vector3(0, 1, 0), at);
    interaction.update(999, 0.01, HEAD);
    expect(plate.group.position.distanceTo(new Vector3(0.3, 1.6, -0.6))).toBeLessThan(1e-6);
  });

  it("holds the world beside the plates: by the grip of a controller, by the pinch of a hand, not by a trigger", () => {
    for (const [bare, kind, holds] of [[false, "squeeze", 1], [true, "select", 1], [false, "select", 0]] as const) {
      const { hand, interaction, grab } = stage(bare);
      hand.set(new Vector3(0.2, 1.3, -0.1), new Vector3(2, 1.3, -0.6));
      interaction.update(0, 0.01, HEAD);
      interaction.press(hand.pointer, kind);
      expect(grab.hands).toBe(holds);
      expect(interaction.grabs(hand.pointer)).toBe(holds === 1);
      interaction.release(hand.pointer, kind);
      expect(grab.hands).toBe(0);
    }
  });

  it("lets a fingertip press once on its way through, and lets go of everything that is lost", () => {
    const { plate, hand, interaction, grab } = stage(true);
    hand.set(new Vector3(0.2, 1.3, -0.1), new Vector3(3, 1.3, -0.1));
    for (const z of [0.03, 0.01, 0.001, -0.004, 0.003, 0.005, 0.03]) {
      hand.pointer.fingertip.set(-0.1, 1.6, -0.6 + z);
      interaction.update(0, 0.01, HEAD);
    }
    expect(plate.heard.map((each) => each.split(" ")[0])).toEqual(["press", "drag", "drag", "drag", "drag", "release"]);
    hand.pointer.fingertip.set(0, 0, 5);
    interaction.press(hand.pointer, "select");
    expect(grab.hands).toBe(1);
    interaction.lose(hand.pointer);
    expect(grab.hands).toBe(0);
  });
});
