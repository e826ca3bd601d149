import { describe, expect, it } from "vitest";
import { measureBend } from "../src/guide/bend";
import type { Measured } from "../src/guide/situation";
import { still } from "../src/guide/situation";
import type { Task } from "../src/guide/trial";
import { progressText, Trial } from "../src/guide/trial";
import type { Hand } from "./held";
import { FPS, COUNT, points, normals, shape, bend, measure, REST } from "./held";

interface Run {
  readonly encoder?: boolean;
  readonly noise?: boolean;
  readonly known?: (share: number) => boolean;
  readonly steered?: (share: number) => boolean;
}

/** Plays a motion from one hand's setting to another in `seconds`, and returns the trial after it. */
function play(task: Task, from: Hand, to: Hand, seconds = 2, run: Run = {}): { trial: Trial; met: boolean } {
  const trial = new Trial();
  const now = still();
  const random = run.noise === true ? normals(7) : null;
  trial.begin(task);
  let met = false;
  const steps = Math.round((seconds + 1) * FPS);
  for (let i = 0; i <= steps; i++) {
    const share = Math.min(1, i / (seconds * FPS));
    const at = (a: number, b: number): number => a + share * (b - a);
    now.nowMs = (1000 * i) / FPS;
    now.dtS = 1 / FPS;
    const hand = {
      insertion: at(from.insertion, to.insertion), roll: at(from.roll, to.roll),
      anterior: at(from.anterior, to.anterior), left: at(from.left, to.left),
    };
    measure(now, hand, run.known?.(share) ?? true, random);
    if (run.encoder === false) now.rollDeg = null;
    now.steered = run.steered?.(share) ?? true;
    met = trial.update(now) || met;
  }
  return { trial, met };
}

const INSERT: Task = { kind: "inserted", mm: 10 };
const ROLL: Task = { kind: "rolled", deg: 45 };
const FLEX: Task = { kind: "flexed", deg: 15 };

describe("what the guide measures of a catheter", () => {
  it("tells the bend and where it looks, whatever the roll", () => {
    for (const roll of [-200, -30, 0, 75, 400]) {
      shape({ ...REST, roll, anterior: 40 });
      measureBend(bend, points, COUNT);
      expect(bend.bendDeg).toBeGreaterThan(34); // chords at both ends see a little less than the whole bend
      expect(bend.bendDeg).toBeLessThan(40.5);
      const seen = bend.towardsDeg - roll;
      expect(Math.abs(seen - 360 * Math.round(seen / 360))).toBeLessThan(3);
    }
  });

  it("does not call a pushed catheter bent, once its flexible end is in the box", () => {
    shape({ ...REST, insertion: 68 });
    measureBend(bend, points, COUNT);
    const before = bend.bendDeg;
    shape({ ...REST, insertion: 110 });
    measureBend(bend, points, COUNT);
    expect(Math.abs(bend.bendDeg - before)).toBeLessThan(2);
  });
});

describe("what a step waits for", () => {
  it("is met by what it asks for, either way", () => {
    for (const by of [13, -13]) expect(play(INSERT, REST, { ...REST, insertion: 70 + by }).met).toBe(true);
    for (const by of [52, -52]) expect(play(ROLL, REST, { ...REST, roll: 10 + by }).met).toBe(true);
    for (const by of [22, -22]) expect(play(FLEX, REST, { ...REST, anterior: 30 + by }).met).toBe(true);
    for (const by of [22, -22]) expect(play(FLEX, REST, { ...REST, left: by }).met).toBe(true);
    expect(play(FLEX, { ...REST, insertion: 30 }, { ...REST, insertion: 30, anterior: 90 }).met).toBe(true);
  });

  it("is not met by less", () => {
    expect(play(INSERT, REST, { ...REST, insertion: 78 }).met).toBe(false);
    expect(play(ROLL, REST, { ...REST, roll: 50 }).met).toBe(false);
    expect(play(FLEX, REST, { ...REST, anterior: 40 }).met).toBe(false);
  });

  it("is not met by noise at rest, for half a minute", () => {
    for (const task of [{ kind: "taken" } as const, INSERT, ROLL, FLEX]) {
      const { trial, met } = play(task, REST, REST, 30, { noise: true });
      expect(met, `${task.kind} ${trial.have}`).toBe(false);
      expect(trial.share, task.kind).toBeLessThan(0.4);
    }
  });

  it("is not met by another manipulation", () => {
    const pushed = { ...REST, insertion: 115 };
    const rolled = { ...REST, roll: 370 };
    const bent = { ...REST, anterior: 95, left: 40 };
    for (const to of [rolled, bent]) expect(play(INSERT, REST, to, 4, { noise: true }).met).toBe(false);
    for (const to of [pushed, bent]) expect(play(ROLL, REST, to, 4, { noise: true }).met).toBe(false);
    for (const to of [pushed, rolled]) expect(play(FLEX, REST, to, 4, { noise: true }).met).toBe(false);
    const curled = { ...REST, anterior: 110 };
    expect(play(FLEX, curled, { ...curled, roll: 38 }, 2).met).toBe(false);
    // A short catheter bends by itself when it comes in: that is no flexing either.
    for (const speed of [2, 6]) expect(play(FLEX, { ...REST, insertion: 20 }, pushed, speed).met).toBe(false);
  });

  it("is met without an encoder by flexing, not by rolling", () => {
    expect(play(FLEX, REST, { ...REST, roll: 370 }, 4, { encoder: false, noise: true }).met).toBe(false);
    expect(play(FLEX, REST, { ...REST, anterior: 60 }, 2, { encoder: false }).met).toBe(true);
    expect(play(ROLL, REST, { ...REST, roll: 370 }, 4, { encoder: false }).met).toBe(false);
  });

  it("does not count what was not seen, nor what a script did", () => {
    const pushed = { ...REST, insertion: 100 };
    const gap = (share: number): boolean => share < 0.1 || share > 0.9; // 3 mm are seen at each end
    expect(play(INSERT, REST, pushed, 2, { known: gap }).met).toBe(false);
    expect(play(INSERT, REST, pushed, 2, { steered: gap }).met).toBe(false);
    // 6 and 4.5 mm at 15 mm/s, of each of which smoothing over 0.15 s may hold 2.3 mm back: pieces add up, the gap does not.
    const { trial } = play(INSERT, REST, pushed, 2, { known: (share) => share < 0.2 || share > 0.85 });
    expect(trial.have).toBeGreaterThan(10.5 - 2 * 2.3 - 0.5);
    expect(trial.have).toBeLessThan(10.5);
    const bent = { ...REST, anterior: 80 };
    expect(play(FLEX, REST, bent, 2, { known: gap }).met).toBe(false);
    expect(play(ROLL, REST, { ...REST, roll: 170 }, 2, { known: gap }).met).toBe(false);
  });

  it("goes on after a moment in which nothing was seen", () => {
    const blinking = (share: number): boolean => Math.floor(40 * share) % 4 !== 0;
    expect(play(INSERT, REST, { ...REST, insertion: 105 }, 4, { known: blinking }).met).toBe(true);
    expect(play(ROLL, REST, { ...REST, roll: 150 }, 4, { known: blinking }).met).toBe(true);
    expect(play(FLEX, REST, { ...REST, anterior: 90 }, 4, { known: blinking }).met).toBe(true);
    expect(play(FLEX, REST, REST, 20, { known: blinking, noise: true }).met).toBe(false);
  });

  it("is taken up by a small push or roll", () => {
    expect(play({ kind: "taken" }, REST, { ...REST, insertion: 76 }).met).toBe(true);
    expect(play({ kind: "taken" }, REST, { ...REST, roll: 30 }).met).toBe(true);
  });
});

/** Lets a trial see frames made by `change`, one after another; returns whether it was met. */
function watch(task: Task, frames: readonly Partial<Measured>[]): { trial: Trial; met: boolean } {
  const trial = new Trial();
  const now = still();
  trial.begin(task);
  let met = false;
  for (const frame of frames) {
    Object.assign(now, { dtS: 1 / FPS }, frame);
    met = trial.update(now) || met;
  }
  return { trial, met };
}

describe("what a step waits for besides the catheter", () => {
  it("counts a view that is turned or zoomed by hand, not one that travels by itself", () => {
    const turning = Array.from({ length: 30 }, (_, i) => ({ handMoved: true, azimuthDeg: i }));
    expect(watch({ kind: "turned", deg: 25 }, turning).met).toBe(true);
    expect(watch({ kind: "turned", deg: 25 }, turning.map((each) => ({ ...each, handMoved: false }))).met).toBe(false);
    const closer = Array.from({ length: 30 }, (_, i) => ({ handMoved: true, size: 1.02 ** i }));
    expect(watch({ kind: "sized", percent: 30 }, closer).met).toBe(true);
    expect(watch({ kind: "turned", deg: 25 }, closer).met).toBe(false);
    expect(watch({ kind: "sized", percent: 30 }, turning).met).toBe(false);
  });

  it("adds up how far the heart is carried, hold by hold", () => {
    const hold = (cm: number, held: boolean): Partial<Measured> => ({ handMoved: held, heartCm: new Float64Array([cm, 0, 0]) });
    const carried = [hold(0, false), hold(0, true), hold(6, true), hold(6, false), hold(40, false), hold(40, true), hold(45, true)];
    expect(watch({ kind: "moved", cm: 10 }, carried).trial.have).toBeCloseTo(11, 9);
    expect(watch({ kind: "moved", cm: 10 }, [hold(0, false), hold(40, false)]).met).toBe(false);
  });

  it("wants a setting changed, in a headset after the menu was opened", () => {
    expect(watch({ kind: "setting", menu: false }, [{ changes: 3 }, { changes: 3 }]).met).toBe(false);
    expect(watch({ kind: "setting", menu: false }, [{ changes: 3 }, { changes: 4 }]).met).toBe(true);
    expect(watch({ kind: "setting", menu: true }, [{ changes: 3 }, { changes: 4 }]).met).toBe(false);
    const opened = watch({ kind: "setting", menu: true }, [{ changes: 3 }, { menuOpen: true }]);
    expect(opened.trial.have).toBe(1);
    expect(watch({ kind: "setting", menu: true }, [{ changes: 3 }, { menuOpen: true }, { changes: 4 }]).met).toBe(true);
  });

  it("wants both pictures looked at", () => {
    const shown = (ice: boolean): Partial<Measured>[] => Array.from({ length: 2 * FPS }, () => ({ ice }));
    expect(watch({ kind: "pictures", seconds: 1.5 }, shown(false)).met).toBe(false);
    expect(watch({ kind: "pictures", seconds: 1.5 }, [...shown(false), ...shown(true)]).met).toBe(true);
    expect(watch({ kind: "pictures", seconds: 1.5 }, [...shown(false), { ice: true }, ...shown(false)]).met).toBe(false);
  });

  it("wants the target reached, and says how far it is", () => {
    const near = watch({ kind: "reached" }, [{ targetMm: 20 }, { targetMm: 5.2 }]);
    expect(near.met).toBe(false);
    expect(near.trial.share).toBeCloseTo(0.74, 2);
    expect(progressText(near.trial)).toBe("5 mm to go");
    expect(watch({ kind: "reached" }, [{ targetMm: 20 }, { targetMm: 1, targetReached: true }]).met).toBe(true);
  });
});
