import { Quaternion, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { AHEAD_M, BELOW_EYES_M, INSIDE_SCALE, inside, levelForward, onTable, trueScale } from "../src/xr/placement";
import { Clearing } from "../src/xr/clearing";
import { Similarity } from "../src/xr/similarity";
import type { Blood } from "../src/xr/standpoint";
import { LEAST_CLEARANCE_MM, standpoint } from "../src/xr/standpoint";
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
  it("puts the head at a place, and what lies in a direction a little below the line of sight", () => {
    const random = makeRandom(11);
    for (let trial = 0; trial < 60; trial++) {
      const head = headAt(6 * random(), random() - 0.5);
      const place = someVector(random).multiplyScalar(0.1);
      const direction = trial === 0 ? UP.clone() : trial === 1 ? UP.clone().negate() : someVector(random).normalize();
      const world = inside(new Similarity(), head, place, direction);
      expect(world.apply(place.clone()).distanceTo(head.position)).toBeLessThan(1e-9);
      const forward = levelForward(head, new Vector3());
      const turned = direction.clone().applyQuaternion(world.orientation);
      expect(turned.angleTo(forward)).toBeCloseTo((12 * Math.PI) / 180, 6);
      expect(turned.y).toBeLessThan(0);
      expect(world.scale).toBe(INSIDE_SCALE);
      // As upright as the direction allows: the heart's own up has no part to the side.
      const up = UP.clone().applyQuaternion(world.orientation);
      if (Math.abs(direction.y) < 0.97) expect(Math.abs(up.dot(forward.clone().cross(UP)))).toBeLessThan(1e-6);
    }
  });
});

/** Two balls of blood, 26 mm in radius and 70 mm apart, that touch nowhere: chambers 1 and 2. */
const CHAMBERS: Blood = {
  clearanceMm: ({ x, y, z }) => Math.max(26 - Math.hypot(x, y, z), 26 - Math.hypot(x - 70, y, z)),
  chamberAt: ({ x, y, z }) => (Math.hypot(x, y, z) < 26 ? 1 : Math.hypot(x - 70, y, z) < 26 ? 2 : 0),
};

describe("a standpoint", () => {
  it("is in the chamber of what is to be seen, away from its walls, with it in sight", () => {
    const random = makeRandom(3);
    const [eye, behind] = [new Vector3(), new Vector3(-1, 0, 0)];
    for (let trial = 0; trial < 8; trial++) {
      const anchor = someVector(random).normalize().multiplyScalar(24 * random());
      if (trial % 2 === 1) anchor.x += 70;
      expect(standpoint(eye, CHAMBERS, anchor, behind)).toBe(true);
      expect(CHAMBERS.chamberAt(eye)).toBe(CHAMBERS.chamberAt(anchor));
      expect(CHAMBERS.clearanceMm(eye)).toBeGreaterThanOrEqual(LEAST_CLEARANCE_MM);
      expect(eye.distanceTo(anchor)).toBeGreaterThan(8);
    }
    standpoint(eye, CHAMBERS, new Vector3(0, 0, 0), behind);
    expect(eye.x, "from behind, where there is room").toBeLessThan(-8);
  });

  it("is in the nearest chamber for something in a wall, and nowhere without one", () => {
    const eye = new Vector3();
    expect(standpoint(eye, CHAMBERS, new Vector3(30, 0, 0), new Vector3(1, 0, 0))).toBe(true);
    expect(CHAMBERS.chamberAt(eye)).toBe(1);
    expect(standpoint(eye, CHAMBERS, new Vector3(0, 200, 0), new Vector3(1, 0, 0))).toBe(false);
    const unknown = { clearanceMm: () => Infinity, chamberAt: () => 0 };
    expect(standpoint(eye, unknown, new Vector3(), new Vector3(1, 0, 0))).toBe(false);
  });
});

describe("a clearing", () => {
  const head = headAt(0);
  const at = (azimuth: number, elevation: number, distance: number): Vector3 =>
    new Vector3(Math.sin(azimuth) * Math.cos(elevation), Math.sin(elevation), -Math.cos(azimuth) * Math.cos(elevation)).multiplyScalar(distance).add(head.position);

  it("is where one wants it, unless something is there: then the nearest free height", () => {
    const room = new Clearing();
    room.begin(head);
    expect(room.nearest(0, -0.4, 0.2, 0.1)).toBe(-0.4);
    room.ball(at(0, -0.5, 0.65), 0.075);
    const free = room.nearest(0, -0.4, 0.2, 0.1);
    expect(room.blocked(0, -0.4, 0.2, 0.1)).toBe(true);
    expect(free).toBeGreaterThan(-0.4);
    expect(room.blocked(0, free, 0.2, 0.1)).toBe(false);
    expect(room.nearest(0, -0.65, 0.2, 0.1)).toBeLessThan(-0.65);
    expect(room.nearest(0.8, -0.4, 0.2, 0.1), "beside it there is room").toBe(-0.4);
    room.begin(head);
    room.ball(head.position, 1);
    expect(room.blocked(0, 0, 0.2, 0.1), "what is all around takes nothing").toBe(false);
  });

  it("goes round two things that stand one over the other", () => {
    const room = new Clearing();
    room.begin(head);
    room.ball(at(0, -0.5, 0.65), 0.075);
    room.ball(at(0, -0.2, 0.65), 0.075);
    const free = room.nearest(0, -0.35, 0.2, 0.1);
    expect(room.blocked(0, free, 0.2, 0.1)).toBe(false);
  });
});
