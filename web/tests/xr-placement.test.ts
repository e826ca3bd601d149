import { Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { AHEAD_M, BELOW_EYES_M, INSIDE_SCALE, inside, levelForward, onTable, trueScale } from "../src/xr/placement";
import { Similarity } from "../src/xr/similarity";
import { makeRandom, someQuaternion, someVector } from "./random";

const UP = new Vector3(0, 1, 0);
const CENTRE = new Vector3(0.06, 0.01, -0.02);

function headAt(yaw: number, pitch = 0): { position: Vector3; orientation: Quaternion } {
  const orientation = new Quaternion().setFromAxisAngle(UP, yaw).multiply(new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), pitch));
  return { position: new Vector3(0.3, 1.6, -0.2), orientation };
}

describe("a similarity", () => {
  it("is undone by its inverse, and composes", () => {
    const random = makeRandom(7);
    for (let trial = 0; trial < 50; trial++) {
      const a = new Similarity().set(someVector(random), someQuaternion(random), 0.2 + 3 * random());
      const b = new Similarity().set(someVector(random), someQuaternion(random), 0.2 + 3 * random());
      const point = someVector(random);
      const both = new Similarity().copy(a).multiply(b);
      expect(both.apply(point.clone()).distanceTo(a.apply(b.apply(point.clone())))).toBeLessThan(1e-9);
      expect(a.applyInverse(a.apply(point.clone())).distanceTo(point)).toBeLessThan(1e-9);
      expect(new Similarity().copy(a).invert().apply(a.apply(point.clone())).distanceTo(point)).toBeLessThan(1e-9);
    }
  });
});

describe("on the table", () => {
  it("stands upright before the viewer, below the eyes, at true scale, whichever way the viewer looks", () => {
    for (const [yaw, pitch] of [[0, 0], [0.8, -0.5], [Math.PI, 0.3], [-2, 1.2], [3.1415926, 0]] as const) {
      const head = headAt(yaw, pitch);
      const world = onTable(new Similarity(), head, CENTRE);
      const centre = world.apply(CENTRE.clone());
      expect(centre.y).toBeCloseTo(1.6 - BELOW_EYES_M, 9);
      expect(centre.x).toBeCloseTo(0.3 - AHEAD_M * Math.sin(yaw), 6);
      expect(centre.z).toBeCloseTo(-0.2 - AHEAD_M * Math.cos(yaw), 6);
      expect(UP.clone().applyQuaternion(world.orientation).angleTo(UP)).toBeLessThan(1e-6);
      expect(world.scale).toBe(1);
      const right = new Vector3(1, 0, 0).applyQuaternion(world.orientation); // the box's x: to the viewer's right
      expect(right.dot(new Vector3(Math.cos(yaw), 0, -Math.sin(yaw)))).toBeCloseTo(1, 6);
    }
  });

  it("knows a level direction for a viewer who looks at the ceiling or the floor", () => {
    for (const pitch of [Math.PI / 2, -Math.PI / 2]) {
      const forward = levelForward(headAt(0.4, pitch), new Vector3());
      expect(forward.y).toBe(0);
      expect(forward.dot(new Vector3(-Math.sin(0.4), 0, -Math.cos(0.4)))).toBeCloseTo(1, 6);
    }
  });
});

describe("true scale", () => {
  it("keeps the heart where it is and how it is turned", () => {
    const head = headAt(0);
    const present = new Similarity().set(new Vector3(0.2, 1.1, -0.7), new Quaternion().setFromAxisAngle(UP, 0.6), 3);
    present.pin(CENTRE, new Vector3(0.4, 1.2, -0.8));
    const world = trueScale(new Similarity(), present, head, CENTRE);
    expect(world.scale).toBe(1);
    expect(world.apply(CENTRE.clone()).distanceTo(new Vector3(0.4, 1.2, -0.8))).toBeLessThan(1e-9);
    expect(world.orientation.angleTo(present.orientation)).toBeLessThan(1e-9);
  });

  it("puts it on the table when it is out of reach", () => {
    const head = headAt(0);
    const present = new Similarity().set(new Vector3(5, 0, 0), new Quaternion(), 10);
    const world = trueScale(new Similarity(), present, head, CENTRE);
    expect(world.apply(CENTRE.clone()).distanceTo(head.position)).toBeCloseTo(Math.hypot(AHEAD_M, BELOW_EYES_M), 6);
  });
});

describe("inside", () => {
  it("looks along the tip, which lies before the eyes and below the line of sight", () => {
    const random = makeRandom(11);
    for (let trial = 0; trial < 60; trial++) {
      const head = headAt(6 * random(), random() - 0.5);
      const tip = someVector(random).multiplyScalar(0.1);
      const direction = trial === 0 ? UP.clone() : trial === 1 ? UP.clone().negate() : someVector(random).normalize();
      const world = inside(new Similarity(), head, tip, direction);
      const forward = levelForward(head, new Vector3());
      expect(direction.clone().applyQuaternion(world.orientation).angleTo(forward)).toBeLessThan(1e-6);
      const way = world.apply(tip.clone()).sub(head.position);
      expect(way.dot(forward)).toBeGreaterThan(0.2);
      expect(way.length()).toBeLessThan(0.5);
      expect(way.y).toBeLessThan(-0.05);
      expect(world.scale).toBe(INSIDE_SCALE);
      // As upright as the direction allows: the heart's own up has no part to the side.
      const up = UP.clone().applyQuaternion(world.orientation);
      if (Math.abs(direction.y) < 0.97) expect(Math.abs(up.dot(forward.clone().cross(UP)))).toBeLessThan(1e-6);
    }
  });
});
