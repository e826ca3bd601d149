import { Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { Grab, SCALE_LIMITS } from "../src/xr/grab";
import { Similarity } from "../src/xr/similarity";
import { makeRandom, someQuaternion, someVector } from "./random";

interface Hand {
  readonly position: Vector3;
  readonly orientation: Quaternion;
}

function hand(x = 0, y = 0, z = 0): Hand {
  return { position: new Vector3(x, y, z), orientation: new Quaternion() };
}

function expectNear(a: Vector3, b: Vector3, within = 1e-9): void {
  expect(a.distanceTo(b)).toBeLessThan(within);
}

function worldAt(random: () => number): Similarity {
  return new Similarity().set(someVector(random), someQuaternion(random), 0.5 + 5 * random());
}

describe("one hand", () => {
  it("carries the world by exactly its own motion, and keeps the point that it holds", () => {
    const random = makeRandom(1);
    for (let trial = 0; trial < 50; trial++) {
      const grab = new Grab();
      grab.place(worldAt(random));
      const one = { position: someVector(random), orientation: someQuaternion(random) };
      const held = grab.world.applyInverse(one.position.clone());
      const scale = grab.world.scale;
      const before = grab.world.orientation.clone();
      const turnedFrom = one.orientation.clone();
      grab.take(one);
      one.position.add(someVector(random));
      one.orientation.premultiply(someQuaternion(random));
      grab.update(0);
      expectNear(grab.world.apply(held), one.position);
      expect(grab.world.scale).toBeCloseTo(scale, 12);
      const turn = one.orientation.clone().multiply(turnedFrom.conjugate());
      expect(grab.world.orientation.angleTo(turn.multiply(before))).toBeLessThan(1e-6);
    }
  });

  it("does not jump when it takes hold, nor when it lets go", () => {
    const random = makeRandom(2);
    const grab = new Grab();
    grab.place(worldAt(random));
    const at = new Similarity().copy(grab.world);
    const one = { position: someVector(random), orientation: someQuaternion(random) };
    grab.take(one);
    grab.update(0);
    expectNear(grab.world.position, at.position);
    expect(grab.world.orientation.angleTo(at.orientation)).toBeLessThan(1e-6);
    grab.release(one, 0);
    one.position.set(9, 9, 9);
    expect(grab.update(10)).toBe(false);
    expectNear(grab.world.position, at.position);
  });
});

describe("two hands", () => {
  it("scale by the ratio of their distances about the point between them", () => {
    const grab = new Grab();
    const [left, right] = [hand(-0.1, 1, -0.5), hand(0.1, 1, -0.5)];
    grab.place(new Similarity().set(new Vector3(0.03, 0.9, -0.6), new Quaternion(), 1));
    const held = grab.world.applyInverse(new Vector3(0, 1, -0.5));
    grab.take(left);
    grab.take(right);
    left.position.x = -0.25;
    right.position.x = 0.25;
    grab.update(0);
    expect(grab.world.scale).toBeCloseTo(2.5, 12);
    expectNear(grab.world.apply(held), new Vector3(0, 1, -0.5));
  });

  it("turn the world as the line between them turns, in many steps as in one", () => {
    const grab = new Grab();
    const [left, right] = [hand(-0.2), hand(0.2)];
    grab.take(left);
    grab.take(right);
    for (let step = 1; step <= 200; step++) {
      const angle = (step / 200) * 1.5 * Math.PI; // farther than half a turn
      left.position.set(-0.2 * Math.cos(angle), 0, 0.2 * Math.sin(angle));
      right.position.set(0.2 * Math.cos(angle), 0, -0.2 * Math.sin(angle));
      grab.update(step);
    }
    const wanted = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), 1.5 * Math.PI);
    expect(grab.world.orientation.angleTo(wanted)).toBeLessThan(1e-6);
    expect(grab.world.scale).toBeCloseTo(1, 9);
  });

  it("turn it about the line between them as both wrists turn", () => {
    const grab = new Grab();
    const [left, right] = [hand(-0.2), hand(0.2)];
    grab.take(left);
    grab.take(right);
    const turn = new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), 0.02);
    for (let step = 0; step < 30; step++) {
      left.orientation.premultiply(turn);
      right.orientation.premultiply(turn);
      grab.update(step);
    }
    expect(grab.world.orientation.angleTo(new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), 0.6))).toBeLessThan(1e-6);
  });

  it("stop at the limits of size, and come back from them", () => {
    const grab = new Grab();
    const [left, right] = [hand(-0.05), hand(0.05)];
    grab.take(left);
    grab.take(right);
    left.position.x = -5;
    right.position.x = 5;
    grab.update(0);
    expect(grab.world.scale).toBe(SCALE_LIMITS[1]);
    left.position.x = -0.0001;
    right.position.x = 0.0001;
    grab.update(1);
    expect(grab.world.scale).toBe(SCALE_LIMITS[0]);
    left.position.x = -0.05;
    right.position.x = 0.05;
    grab.update(2);
    expect(grab.world.scale).toBeCloseTo(1, 9);
    expect(Number.isFinite(grab.world.position.length())).toBe(true);
  });

  it("do not let the world jump when one joins or leaves", () => {
    const random = makeRandom(3);
    const grab = new Grab();
    grab.place(worldAt(random));
    const hands = [0, 1].map(() => ({ position: someVector(random), orientation: someQuaternion(random) }));
    const at = new Similarity();
    const step = (act: () => void): void => {
      grab.update(0);
      at.copy(grab.world);
      act();
      grab.update(0);
      expectNear(grab.world.position, at.position, 1e-9);
      expect(grab.world.orientation.angleTo(at.orientation)).toBeLessThan(1e-6);
      expect(grab.world.scale).toBeCloseTo(at.scale, 9);
      for (const each of hands) {
        each.position.add(someVector(random).multiplyScalar(0.1));
        each.orientation.premultiply(someQuaternion(random));
      }
    };
    step(() => grab.take(hands[0]!));
    step(() => grab.take(hands[1]!));
    step(() => grab.release(hands[0]!, 0));
    step(() => grab.take(hands[0]!));
    step(() => grab.release(hands[1]!, 0));
  });
});

describe("letting go", () => {
  it("rights a world that is nearly upright about the hand, smoothly, and no other", () => {
    const up = new Vector3(0, 1, 0);
    for (const [tilt, righted] of [[0.15, true], [0.8, false]] as const) {
      const grab = new Grab();
      const one = hand(0.2, 1, -0.4);
      const turn = new Quaternion().setFromAxisAngle(new Vector3(0.6, 0, 0.8), tilt);
      grab.place(new Similarity().set(new Vector3(0, 1, -0.5), turn.multiply(new Quaternion().setFromAxisAngle(up, 0.7)), 1));
      const held = grab.world.applyInverse(one.position.clone());
      grab.take(one);
      grab.release(one, 1000);
      let last = grab.world.orientation.clone();
      for (let now = 1000; now < 1600; now += 11) {
        grab.update(now);
        expect(grab.world.orientation.angleTo(last)).toBeLessThan(0.012);
        expectNear(grab.world.apply(held.clone()), one.position, 1e-9);
        last = grab.world.orientation.clone();
      }
      const left = up.clone().applyQuaternion(grab.world.orientation).angleTo(up);
      expect(left).toBeCloseTo(righted ? 0 : tilt, 6);
    }
  });
});
