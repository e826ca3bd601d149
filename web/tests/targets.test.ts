import { Line3, Matrix4, Vector3 } from "three";
import { describe, expect, it } from "vitest";
import type { SceneDescription } from "../src/generated/messages";
import type { TargetMeasure } from "../src/maths/target";
import { Dwell, makeTargetMeasure, measureTarget, REACH_RULE } from "../src/maths/target";
import type { DrawnTrack } from "../src/motion/drawn";
import type { Target } from "../src/scene/target_book";
import { TargetBook } from "../src/scene/target_book";
import { TargetWatch } from "../src/scene/target_watch";
import { makeRandom, someQuaternion, someVector } from "./random";

const ARRAY: [number, number, number] = [1.5, 0, -5];
const DEPTH_MM = 90;

function measured(pose: Matrix4, at: [number, number, number]): TargetMeasure {
  const out = makeTargetMeasure();
  measureTarget(out, pose.elements, ...at, ARRAY, DEPTH_MM);
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

  it("the beam's middle line ends at the array and at its depth", () => {
    // From (55, 0, 1.5) to (55, 0, 91.5).
    const far = measured(ALONG_X, [58, 4, 60]);
    expect(far.beamDistanceMm).toBeCloseTo(5, 9); // 3-4-5 across
    expect([...far.foot].map((value) => Number(value.toFixed(6)))).toEqual([55, 0, 60]);
    expect(measured(ALONG_X, [55, 0, 100]).beamDistanceMm).toBeCloseTo(8.5, 9); // beyond the depth
    expect(measured(ALONG_X, [55, 12, 96.5]).beamDistanceMm).toBeCloseTo(13, 9); // 5-12-13
    expect(measured(ALONG_X, [55, 0, -8.5]).beamDistanceMm).toBeCloseTo(10, 9); // behind the face
    expect(measured(ALONG_X, [55, 0, -8.5]).beamAngleDeg).toBeCloseTo(180, 9);
  });

  it("agrees with three's own geometry for any pose and place", () => {
    const random = makeRandom(8);
    const line = new Line3();
    const foot = new Vector3();
    for (let i = 0; i < 200; i++) {
      const pose = new Matrix4().compose(someVector(random).multiplyScalar(50), someQuaternion(random), new Vector3(1, 1, 1));
      const at = someVector(random).multiplyScalar(60);
      const { distanceMm, angleDeg, beamDistanceMm, beamAngleDeg } = measured(pose, [at.x, at.y, at.z]);
      const [x, y, z] = [new Vector3(), new Vector3(), new Vector3()];
      pose.extractBasis(x, y, z);
      const tip = new Vector3().setFromMatrixPosition(pose);
      const array = new Vector3(...ARRAY).applyMatrix4(pose);
      expect(distanceMm).toBeCloseTo(at.distanceTo(tip), 6);
      expect(angleDeg).toBeCloseTo((at.clone().sub(tip).angleTo(z) * 180) / Math.PI, 5);
      expect(beamAngleDeg).toBeCloseTo((at.clone().sub(array).angleTo(x) * 180) / Math.PI, 5);
      line.set(array, array.clone().addScaledVector(x, DEPTH_MM)).closestPointToPoint(at, true, foot);
      expect(beamDistanceMm).toBeCloseTo(at.distanceTo(foot), 6);
    }
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
    expect(stay(dwell, 3, REACH_RULE.radiusMm + 0.01) + stay(dwell, 3, 0.6 * REACH_RULE.radiusMm, REACH_RULE.angleDeg + 0.1)).toBe(0);
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

  it("asks for no angle where the tip is there already, but always for the beam's", () => {
    const dwell = new Dwell({ radiusMm: 4, angleDeg: 15, dwellS: 1 });
    expect(stay(dwell, 1.1, 1.9, 170)).toBe(1);
    const beam = new Dwell({ radiusMm: 4, angleDeg: 15, dwellS: 1, by: "beam" });
    expect(stay(beam, 1.1, 1.9, 170)).toBe(0);
    expect([beam.near, beam.aligned]).toEqual([true, false]);
    expect(stay(beam, 1.1, 1.9, 14)).toBe(1);
  });

  it("waits anew when the tip was lost in between", () => {
    const dwell = new Dwell();
    stay(dwell, 0.9, 1);
    dwell.interrupt();
    expect(stay(dwell, 0.9, 1)).toBe(0);
  });
});

describe("TargetWatch", () => {
  const STEP_S = 1 / 30;
  const ahead: Target = { id: "a", name: "Ahead", position: new Vector3(62.5, 0, 0), radiusMm: 3, own: false };
  const inBeam: Target = { id: "b", name: "In the beam", position: new Vector3(55, 0, 40), radiusMm: 3, own: false };

  function watching(): { watch: TargetWatch; stay: (target: Target, seconds: number, more?: { status?: string; ice?: boolean; beam?: boolean; stale?: boolean }) => number } {
    const watch = new TargetWatch();
    watch.describe(3);
    let frame = 0;
    const stay = (target: Target, seconds: number, { status = "tracked", ice = false, beam = true, stale = false } = {}): number => {
      let reached = 0;
      for (let i = 0; i < Math.round(seconds / STEP_S); i++) {
        const track = { t: 500 + STEP_S * frame++, status, stale } as unknown as DrawnTrack;
        if (watch.step(target, { matrix: ALONG_X, beam }, track, ice, DEPTH_MM)) reached += 1;
      }
      return reached;
    };
    return { watch, stay };
  }

  it("reaches by the tip, once, and tells both pairs of figures", () => {
    const { watch, stay } = watching();
    expect(stay(ahead, 0.9)).toBe(0);
    expect(watch.figures.dwelt).toBeGreaterThan(0.8);
    expect(stay(ahead, 0.3)).toBe(1);
    expect(stay(ahead, 3)).toBe(0);
    const { by, distanceMm, angleDeg, beamDistanceMm, beamAngleDeg, reached } = watch.figures;
    expect([by, reached]).toEqual(["tip", true]);
    expect([distanceMm, angleDeg]).toEqual([2.5, 0]);
    expect(beamDistanceMm).toBeCloseTo(Math.hypot(7.5, 1.5), 6);
    expect(beamAngleDeg).toBeCloseTo(90 + (Math.atan2(1.5, 7.5) * 180) / Math.PI, 6);
  });

  it("reaches by the beam where the ultrasound was on when the watch began, and not by the tip then", () => {
    const { watch, stay } = watching();
    expect(stay(inBeam, 1.2, { ice: true })).toBe(1);
    expect(watch.by).toBe("beam");
    const other = watching();
    expect(other.stay(ahead, 0.1, { ice: true }) + other.stay(ahead, 2, { ice: false })).toBe(0); // still by the beam
    other.watch.restart();
    expect(other.stay(ahead, 2)).toBe(1);
    expect(watching().stay(inBeam, 2)).toBe(0); // by the tip: 40 mm away
  });

  it("goes by a target's own rule, and by the tip where that does not say", () => {
    const { watch, stay } = watching();
    const rule = { radiusMm: 50, angleDeg: 180, dwellS: 0.2 };
    expect(stay({ ...inBeam, rule }, 0.3, { ice: true })).toBe(1);
    expect(watch.by).toBe("tip");
    expect(stay({ ...inBeam, id: "c", rule: { ...rule, by: "beam" } }, 0.3)).toBe(1);
    expect(watch.by).toBe("beam");
  });

  it("does not count the time of predictions, and a lost tip begins the wait anew", () => {
    const { watch, stay } = watching();
    stay(ahead, 0.7);
    const before = watch.figures.dwelt;
    expect(stay(ahead, 3, { status: "coasting" })).toBe(0);
    expect(watch.figures.dwelt).toBe(before);
    expect(stay(ahead, 0.45)).toBe(1);
    const lost = watching();
    lost.stay(ahead, 0.9);
    lost.watch.interrupt();
    expect(lost.stay(ahead, 0.9)).toBe(0);
    expect(lost.stay(ahead, 0.3)).toBe(1);
  });

  it("does not count a paused recording, nor what lies between two instants far apart or back in time", () => {
    const { watch } = watching();
    const at = (t: number): boolean => watch.step(ahead, { matrix: ALONG_X, beam: true }, { t, status: "tracked", stale: false } as unknown as DrawnTrack, false, DEPTH_MM);
    for (let i = 0; i < 300; i++) expect(at(7)).toBe(false);
    for (let i = 0; i < 10; i++) expect(at(10 + 2 * i)).toBe(false);
    for (let i = 0; i < 9; i++) expect(at(40 + i / 10)).toBe(false);
    for (let i = 0; i < 9; i++) expect(at(30 + i / 10)).toBe(false);
  });

  it("says nothing of a beam whose direction is not known, and does not reach by it", () => {
    const { watch, stay } = watching();
    expect(stay(inBeam, 3, { ice: true, beam: false })).toBe(0);
    expect([watch.figures.beamDistanceMm, watch.figures.beamAngleDeg, watch.figures.within]).toEqual([null, null, false]);
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
