import { Box3, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import { raisedM } from "../src/training/xr/above";

const head = new Vector3(0, 1.4, 0);
const standing = { head, forward: new Vector3(0, 0, -1), aheadM: 0.68, lowerM: 1.16, halfWidthM: 0.3 };
const heart = (x: number, top: number, z: number): Box3 => new Box3(new Vector3(x - 0.1, top - 0.2, z - 0.1), new Vector3(x + 0.1, top, z + 0.1));

describe("a plate before a heart", () => {
  it("goes up until its lower edge is seen above it", () => {
    const up = raisedM(heart(0, 1.2, -0.6), standing);
    // the top's far edge, 0.7 m away and 0.2 m below the eyes, is 0.194 m below them at the plate
    expect(up).toBeCloseTo(1.4 - (0.2 * 0.68) / 0.7 + 0.015 - 1.16, 9);
  });

  it("stays where nothing nearer covers it", () => {
    expect(raisedM(heart(0, 1.2, -1.2), standing)).toBe(0); // farther than the plate
    expect(raisedM(heart(0, 1.0, -0.5), standing)).toBe(0); // below it
    expect(raisedM(heart(0.9, 1.3, -0.6), standing)).toBe(0); // beside it
    expect(raisedM(new Box3(), standing)).toBe(0);
  });

  it("stays where no height would do", () => {
    expect(raisedM(heart(0, 1.45, 0), standing)).toBe(0); // round the head
    expect(raisedM(heart(0, 1.8, -0.5), standing)).toBe(0); // as tall as the wearer
  });
});
