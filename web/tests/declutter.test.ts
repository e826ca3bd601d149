import { describe, expect, it } from "vitest";
import { LabelCrowd } from "../src/maths/declutter";
import { makeRandom } from "./random";

const FRAME_S = 1 / 90;

interface Place { readonly x: number; readonly y: number; readonly distance?: number; readonly rank?: number; readonly halfWidth?: number }

function put(crowd: LabelCrowd, places: readonly Place[]): void {
  places.forEach(({ x, y, distance = 0.3, rank = 1, halfWidth = 0.05 }, i) => {
    crowd.x[i] = x;
    crowd.y[i] = y;
    crowd.halfWidth[i] = halfWidth;
    crowd.halfHeight[i] = 0.01;
    crowd.distance[i] = distance;
    crowd.rank[i] = rank;
  });
}

function crowdOf(places: readonly Place[]): LabelCrowd {
  const crowd = new LabelCrowd();
  crowd.restart(places.length);
  put(crowd, places);
  crowd.settle(FRAME_S);
  return crowd;
}

const shown = (crowd: LabelCrowd): boolean[] => Array.from({ length: crowd.count }, (_, i) => crowd.isShown(i));
const overlap = (a: Place, b: Place): number => Math.min(0.1 - Math.abs(a.x - b.x), 0.02 - Math.abs(a.y - b.y));

describe("labels over each other", () => {
  it("the nearer one is shown, and one that is clear of both", () => {
    const crowd = crowdOf([{ x: 0, y: 0, distance: 0.4 }, { x: 0.02, y: 0.004, distance: 0.3 }, { x: 0, y: 0.05 }]);
    expect(shown(crowd)).toEqual([false, true, true]);
    expect([...crowd.opacity.subarray(0, 3)]).toEqual([0, 1, 1]); // at once, where nothing was before
  });

  it("the one of lower rank wins at any distance", () => {
    expect(shown(crowdOf([{ x: 0, y: 0, distance: 0.1 }, { x: 0, y: 0, distance: 9, rank: 0 }]))).toEqual([false, true]);
  });

  it("what is behind the viewer is not shown and takes no room", () => {
    expect(shown(crowdOf([{ x: 0, y: 0, distance: -0.2, rank: 0 }, { x: 0, y: 0 }]))).toEqual([false, true]);
  });

  it("no two that are shown overlap by more than a share of their height, in any crowd", () => {
    const random = makeRandom(11);
    for (let round = 0; round < 40; round++) {
      const places = Array.from({ length: 40 }, (): Place => ({ x: 0.6 * random(), y: 0.4 * random(), distance: 0.1 + random(), rank: Math.floor(4 * random()) }));
      const crowd = crowdOf(places);
      const seen = places.filter((_, i) => crowd.isShown(i));
      expect(seen.length).toBeGreaterThan(5);
      const overlaps = seen.flatMap((a, i) => seen.slice(i + 1).map((b) => overlap(a, b)));
      expect(Math.max(...overlaps)).toBeLessThanOrEqual(1e-6);
      // And none is left out that nothing stands in the way of.
      const free = places.filter((place, i) => !crowd.isShown(i) && !seen.some((other) => overlap(place, other) > -0.0061));
      expect(free).toEqual([]);
    }
  });

  it("nothing flickers: labels at the same place do not take turns, nor does one that trembles at another's edge", () => {
    const random = makeRandom(12);
    const tremble = (): Place[] => [
      { x: 0, y: 0, distance: 0.3 + 0.004 * (random() - 0.5) },
      { x: 0, y: 0.002, distance: 0.3 + 0.004 * (random() - 0.5) },
      { x: 0.106 + 0.004 * (random() - 0.5), y: 0, distance: 0.5 }, // at the edge of what counts as clear
    ];
    const crowd = crowdOf(tremble());
    const before = shown(crowd);
    let changes = 0;
    for (let i = 1; i < 900; i++) {
      put(crowd, tremble());
      const was = shown(crowd);
      crowd.settle(FRAME_S);
      if (String(shown(crowd)) !== String(was)) changes += 1;
    }
    expect(before.slice(0, 2).filter(Boolean)).toHaveLength(1);
    expect(changes).toBeLessThanOrEqual(1);
  });

  it("one that is shown may touch another, and goes only when it is overlapped by more", () => {
    const crowd = crowdOf([{ x: 0, y: 0, rank: 0 }, { x: 0.11, y: 0 }]);
    for (const [x, seen] of [[0.1, true], [0.0985, true], [0.095, false]] as const) { // 0.1: edge on edge
      put(crowd, [{ x: 0, y: 0, rank: 0 }, { x, y: 0 }]);
      crowd.settle(FRAME_S);
      expect(crowd.isShown(1)).toBe(seen);
    }
  });

  it("one that comes free fades in after a moment, and out at once where it gets in the way, without a jump", () => {
    const apart: Place[] = [{ x: 0, y: 0, rank: 0 }, { x: 0.3, y: 0 }];
    const over: Place[] = [{ x: 0, y: 0, rank: 0 }, { x: 0.02, y: 0 }];
    const crowd = crowdOf(over);
    put(crowd, apart);
    const rising: number[] = [];
    for (let i = 0; i < 60; i++) {
      crowd.settle(FRAME_S);
      rising.push(crowd.opacity[1]!);
    }
    expect(rising[10]).toBe(0); // 0.12 s
    expect(rising[59]).toBe(1);
    for (let i = 1; i < 60; i++) expect(rising[i]! - rising[i - 1]!).toBeLessThan(0.2);
    put(crowd, over);
    expect(crowd.settle(FRAME_S)).toBe(true);
    for (let i = 0; i < 60; i++) crowd.settle(FRAME_S);
    expect(crowd.opacity[1]).toBe(0);
    expect(crowd.settle(FRAME_S)).toBe(false); // at rest: nothing to be drawn anew
  });
});
