import { Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { SceneDescription } from "../src/generated/messages";
import type { TargetMeasure } from "../src/maths/target";
import { Dwell, measureTarget, REACH_RULE } from "../src/maths/target";
import { TargetBook } from "../src/scene/target_book";

const ARRAY: [number, number, number] = [1.5, 0, -5];

function measured(pose: Matrix4, at: [number, number, number]): TargetMeasure {
  const out: TargetMeasure = { distanceMm: NaN, angleDeg: NaN, beamAngleDeg: NaN };
  measureTarget(out, pose.elements, ...at, ARRAY);
  return out;
}

/** A tip at (60, 0, 0) that looks along +x of the box and whose beam looks along +z. */
const ALONG_X = new Matrix4().makeBasis(new Vector3(0, 0, 1), new Vector3(0, 1, 0).negate(), new Vector3(1, 0, 0)).setPosition(60, 0, 0);

describe("measureTarget, against geometry by hand", () => {
  it("straight ahead", () => {
    const { distanceMm, angleDeg } = measured(ALONG_X, [70, 0, 0]);
    expect(distanceMm).toBeCloseTo(10, 9);
    expect(angleDeg).toBeCloseTo(0, 9);
  });

  it("beside: 3-4-5", () => {
    const { distanceMm, angleDeg } = measured(ALONG_X, [64, 3, 0]);
    expect(distanceMm).toBeCloseTo(5, 9);
    expect(angleDeg).toBeCloseTo((Math.atan2(3, 4) * 180) / Math.PI, 9);
  });

  it("behind", () => {
    expect(measured(ALONG_X, [40, 0, 0]).angleDeg).toBeCloseTo(180, 9);
  });

  it("the beam begins in the middle of the array, 5 mm behind the tip and on its side", () => {
    // The array's middle is at (55, 0, 1.5), the beam along +z.
    expect(measured(ALONG_X, [55, 0, 30]).beamAngleDeg).toBeCloseTo(0, 9);
    expect(measured(ALONG_X, [65, 0, 11.5]).beamAngleDeg).toBeCloseTo(45, 9);
    expect(measured(ALONG_X, [55, 7, 1.5]).beamAngleDeg).toBeCloseTo(90, 9);
  });

  it("small angles are not rounded off", () => {
    expect(measured(ALONG_X, [160, 1e-6, 0]).angleDeg).toBeCloseTo((1e-8 * 180) / Math.PI, 14);
  });

  it("at the target itself every angle is good", () => {
    expect(measured(ALONG_X, [60, 0, 0.2]).angleDeg).toBe(0);
  });
});

describe("Dwell", () => {
  const step = 1 / 90;
  const stay = (dwell: Dwell, seconds: number, mm: number, deg = 0): number => {
    let reached = 0;
    for (let i = 0; i < Math.round(seconds / step); i++) reached += dwell.step(mm, deg, step) ? 1 : 0;
    return reached;
  };

  it("is reached once, after the dwell time within radius and angle", () => {
    const dwell = new Dwell();
    expect(stay(dwell, 0.95, 4, 10)).toBe(0);
    expect(dwell.share).toBeGreaterThan(0.9);
    expect(stay(dwell, 0.1, 4, 10)).toBe(1);
    expect(stay(dwell, 2, 4, 10)).toBe(0);
    expect(dwell.reached).toBe(true);
  });

  it("is not reached where distance or angle is not good enough", () => {
    const dwell = new Dwell();
    expect(stay(dwell, 3, REACH_RULE.radiusMm + 0.01) + stay(dwell, 3, 1, REACH_RULE.angleDeg + 0.1)).toBe(0);
    expect([dwell.share, dwell.within]).toEqual([0, false]);
  });

  it("begins anew after leaving, but not by noise at the edge", () => {
    const dwell = new Dwell();
    stay(dwell, 0.8, 4.9);
    stay(dwell, step, 5.2);
    expect(dwell.within).toBe(true);
    stay(dwell, step, 5.6);
    expect(dwell.share).toBe(0);
    expect(stay(dwell, 0.5, 4.9)).toBe(0);
    expect(stay(dwell, 0.6, 4.9)).toBe(1);
  });

  it("waits anew when the tip was lost in between", () => {
    const dwell = new Dwell();
    stay(dwell, 0.9, 1);
    dwell.interrupt();
    expect(stay(dwell, 0.9, 1)).toBe(0);
  });
});

class Shelf implements Storage {
  private readonly kept = new Map<string, string>();
  get length(): number { return this.kept.size; }
  clear(): void { this.kept.clear(); }
  getItem(key: string): string | null { return this.kept.get(key) ?? null; }
  key(): string | null { return null; }
  removeItem(key: string): void { this.kept.delete(key); }
  setItem(key: string, value: string): void { this.kept.set(key, value); }
}

function sceneAt(x: number, attribution = "one heart"): SceneDescription {
  const registration = {
    kind: "rigid", ct_from_box: { rotation_wxyz: [1, 0, 0, 0], translation_mm: [x, 0, 0] }, scale: 1, linear: null,
    fre_mm: null, tre_mm: null, predicted_tre_mm: null, worst_tre_mm: null, date: null,
  };
  const targets = ["tricuspid_valve", "svc"].map((name, i) => ({
    name, label: i === 0 ? "Tricuspid valve" : "", position_mm: [10 * i, 0, 0], radius_mm: 4, normal: null, diameter_mm: null,
  }));
  return { heart: { attribution, registration }, targets } as unknown as SceneDescription;
}

describe("TargetBook", () => {
  it("has the scene's targets by their names, the first in force, and goes round them", () => {
    const book = new TargetBook();
    book.describe(sceneAt(0));
    expect(book.targets.map(({ name }) => name)).toEqual(["Tricuspid valve", "svc"]);
    expect(book.active!.name).toBe("Tricuspid valve");
    book.step(-1);
    expect(book.active!.name).toBe("svc");
  });

  it("keeps own targets with the heart: they move with a new registration, and another heart has none", () => {
    const shelf = new Shelf();
    const book = new TargetBook(shelf);
    book.describe(sceneAt(0));
    const own = book.add(new Vector3(20, 5, 0))!;
    expect(book.active).toBe(own);
    const later = new TargetBook(shelf);
    later.describe(sceneAt(3));
    const found = later.targets.find((each) => each.own)!;
    expect([found.name, ...found.position.toArray()]).toEqual([own.name, 17, 5, 0]);
    later.describe(sceneAt(0, "another heart"));
    expect(later.targets.some((each) => each.own)).toBe(false);
    book.remove(own.id);
    book.remove("scene-svc"); // not its own: stays
    expect(book.targets).toHaveLength(2);
    later.describe(sceneAt(0));
    expect(later.targets).toHaveLength(2);
  });

  it("is not taken in by what somebody else has stored", () => {
    const shelf = new Shelf();
    shelf.setItem("cathxr.targets:one heart", JSON.stringify([{ name: "x", at: [1, 2], radiusMm: 3 }, null, { name: 1 }, "…"]));
    const book = new TargetBook(shelf);
    book.describe(sceneAt(0));
    expect(book.targets).toHaveLength(2);
    shelf.setItem("cathxr.targets:one heart", "{");
    book.describe(sceneAt(0));
    expect(book.targets).toHaveLength(2);
  });
});
