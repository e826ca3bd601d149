import { describe, expect, it } from "vitest";
import { measureBend } from "../src/guide/bend";
import type { Memory, Note } from "../src/guide/guide";
import { Guide, LINGER_MS, OFFER_MS } from "../src/guide/guide";
import { StoredMemory } from "../src/guide/memory";
import type { Measured, Situation } from "../src/guide/situation";
import { still } from "../src/guide/situation";
import { STEPS, wordsOf } from "../src/guide/steps";
import type { Task } from "../src/guide/trial";
import { progressText, Trial } from "../src/guide/trial";
import { headsetLines } from "../src/guide/words";
import { makeRandom } from "./random";

const FPS = 60;
const MOUSE: Situation = {
  place: "mouse", mover: "twin", roll: true, heart: true, space: true, free: true, settings: true, ice: true, targets: true,
};
const RAD = Math.PI / 180;

/** What a hand sets. */
interface Hand {
  insertion: number;
  roll: number;
  anterior: number;
  left: number;
}

const COUNT = 50;
const points = new Float64Array(3 * COUNT);
const clean = new Float64Array(3 * COUNT);
let shaped = "";

/** Returns a source of normally distributed numbers (Box and Muller). */
function normals(seed: number): () => number {
  const random = makeRandom(seed);
  return () => Math.sqrt(-2 * Math.log(1 - random())) * Math.cos(2 * Math.PI * random());
}

/**
 * Writes the points of a catheter that enters along +x: a straight shaft, the last 57 mm of which bend evenly (but for
 * 5 mm of stiff end) by anterior and left, both of which turn with the roll. Only what is in the box is bent: the inlet
 * holds the rest straight. By hand from the definition; 0.1 mm steps.
 */
function shape(hand: Hand): void {
  const key = JSON.stringify(hand);
  if (key !== shaped) bendLine(hand);
  shaped = key;
  points.set(clean);
}

function bendLine({ insertion, roll, anterior, left }: Hand): void {
  const c = Math.cos(roll * RAD), s = Math.sin(roll * RAD);
  // Roll zero looks along -y; left is z x beam = x-axis cross -y = -z.
  const ky = -(anterior * c - left * s), kz = -(anterior * s + left * c);
  const bend = Math.hypot(ky, kz) * RAD;
  const [ny, nz] = bend > 0 ? [(ky * RAD) / bend, (kz * RAD) / bend] : [0, 0];
  const steps = Math.round(insertion / 0.1);
  let angle = 0, x = 0, across = 0;
  const line: [number, number][] = [[0, 0]];
  for (let i = 0; i < steps; i++) {
    const toTip = insertion - (i + 0.5) * (insertion / steps);
    if (toTip > 5 && toTip < 57) angle += (bend / 52) * (insertion / steps);
    x += Math.cos(angle) * (insertion / steps);
    across += Math.sin(angle) * (insertion / steps);
    line.push([x, across]);
  }
  for (let k = 0; k < COUNT; k++) {
    const [px, pa] = line[Math.round(((COUNT - 1 - k) / (COUNT - 1)) * steps)]!;
    clean[3 * k] = px;
    clean[3 * k + 1] = pa * ny;
    clean[3 * k + 2] = pa * nz;
  }
}

const bend = { lengthMm: 0, bendDeg: 0, towardsDeg: 0 };

/** Writes what the guide measures of a catheter; noiseMm: of each point. */
function measure(now: Measured, hand: Hand, known = true, random: (() => number) | null = null, noiseMm = 0.12): void {
  shape(hand);
  if (random !== null) for (let i = 0; i < points.length; i++) points[i]! += noiseMm * random();
  now.known = known;
  now.steered = true;
  if (!known) return;
  measureBend(bend, points, COUNT);
  now.insertedMm = bend.lengthMm;
  now.bendDeg = bend.bendDeg;
  now.bendTowardsDeg = bend.towardsDeg;
  now.rollDeg = hand.roll + (random === null ? 0 : 0.3 * random());
}

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

const REST: Hand = { insertion: 70, roll: 10, anterior: 30, left: 0 };
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

class Notes implements Memory {
  readonly notes: Partial<Record<"page" | "headset", Note>> = {};
  read(kind: "page" | "headset"): Note | null {
    return this.notes[kind] ?? null;
  }
  write(kind: "page" | "headset", note: Note): void {
    this.notes[kind] = note;
  }
}

function ids(now: Partial<Situation>): string[] {
  const guide = new Guide(new Notes());
  guide.enter({ ...MOUSE, ...now });
  return guide.steps.map(({ id }) => id);
}

const ALL = ["take", "insert", "roll", "flex", "turn", "size", "settings", "picture", "target", "end"];

describe("the guide", () => {
  it("leaves out what makes no sense", () => {
    expect(ids({})).toEqual(ALL);
    expect(ids({ roll: false })).toEqual(ALL.filter((id) => id !== "roll"));
    expect(ids({ heart: false })).toEqual(ALL.filter((id) => id !== "picture" && id !== "target"));
    expect(ids({ mover: "nobody" })).toEqual(["take", "turn", "size", "settings", "picture", "end"]);
    expect(ids({ settings: false, ice: false, targets: false })).toEqual(["take", "insert", "roll", "flex", "turn", "size", "end"]);
    expect(ids({ space: false })).toEqual(ALL.filter((id) => id !== "turn" && id !== "size" && id !== "target"));
  });

  it("has words for every situation, none of them for another one", () => {
    for (const place of ["mouse", "touch", "controllers", "hands"] as const) {
      for (const mover of ["twin", "hand", "nobody"] as const) {
        for (const roll of [true, false]) {
          const now = { ...MOUSE, place, mover, roll };
          for (const step of STEPS.filter((each) => each.fits(now))) {
            const words = wordsOf(step, now);
            expect(words.length, `${step.id} ${place} ${mover}`).toBeGreaterThan(20);
            if (place !== "mouse") expect(words, step.id).not.toMatch(/\bkeys?\b|mouse|Hold W/);
            if (place !== "controllers") expect(words, step.id).not.toMatch(/grip|trigger/);
            if (mover === "hand") expect(words, step.id).not.toMatch(/simulated|button.* below/);
            if (!roll) expect(words, step.id).not.toMatch(/turns when you roll/);
          }
        }
      }
    }
  });

  it("goes on by itself when a step is done, after a moment to see it", () => {
    const guide = new Guide(new Notes());
    guide.enter(MOUSE);
    let met = 0;
    guide.onMet = () => (met += 1);
    guide.start();
    const now = still();
    now.dtS = 1 / FPS;
    for (let i = 0; guide.step?.id === "take" && i < 2000; i++) {
      now.nowMs += 1000 / FPS;
      measure(now, { ...REST, insertion: 70 + Math.min(6, 0.1 * i) });
      guide.update(now);
      if (guide.done && i < 100) expect(met).toBe(1);
    }
    expect(guide.step?.id).toBe("insert");
    expect(guide.done).toBe(false);
    expect(now.nowMs).toBeGreaterThan(LINGER_MS);
    expect(guide.trial.have).toBe(0); // what was done for the step before does not count
  });

  it("can be gone through by Next and back again; what is done stays done and waits", () => {
    const guide = new Guide(new Notes());
    guide.enter(MOUSE);
    guide.start();
    for (const id of ALL) {
      expect(guide.step?.id).toBe(id);
      guide.next();
    }
    expect(guide.phase).toBe("idle");
    guide.start();
    guide.next();
    const now = still();
    now.dtS = 1 / FPS;
    for (let i = 0; !guide.done && i < 500; i++) {
      now.nowMs += 1000 / FPS;
      measure(now, { ...REST, insertion: 70 + 0.2 * i });
      guide.update(now);
    }
    guide.next();
    guide.back();
    expect(guide.step?.id).toBe("insert");
    expect(guide.done).toBe(true);
    now.nowMs += 10 * LINGER_MS;
    guide.update(now);
    expect(guide.step?.id).toBe("insert");
    guide.back();
    guide.back();
    expect(guide.step?.id).toBe("take");
  });

  it("is offered once, and not again after a no, an end, or no answer", () => {
    for (const answer of ["no", "skip", "finish", "none"] as const) {
      const notes = new Notes();
      const guide = new Guide(notes);
      guide.enter(MOUSE);
      guide.offer(0);
      expect(guide.phase).toBe("offered");
      if (answer === "no") guide.decline();
      if (answer === "skip") {
        guide.next();
        guide.next();
        expect(guide.skip()).toBe(true);
      }
      if (answer === "finish") for (let i = 0; i <= ALL.length; i++) guide.next();
      if (answer === "none") {
        const now = still();
        now.nowMs = OFFER_MS + 1;
        guide.update(now);
      }
      expect(guide.phase, answer).toBe("idle");
      expect(guide.skip()).toBe(false);
      const again = new Guide(notes);
      again.enter(MOUSE);
      again.offer(0);
      expect(again.phase, answer).toBe("idle");
      expect(again.resumesAt, answer).toBe(answer === "skip" ? 2 : null);
      // What is known of pages says nothing about headsets.
      again.enter({ ...MOUSE, place: "controllers" });
      again.offer(0);
      expect(again.phase).toBe("offered");
    }
  });

  it("is taken up where it was left, or from the beginning", () => {
    const notes = new Notes();
    const guide = new Guide(notes);
    guide.enter(MOUSE);
    guide.start();
    for (let i = 0; i < 4; i++) guide.next();
    guide.skip();
    const later = new Guide(notes);
    later.enter(MOUSE);
    expect(later.resumesAt).toBe(5);
    later.start();
    expect(later.step?.id).toBe("turn");
    later.skip();
    later.start(true);
    expect(later.step?.id).toBe("take");
    // A page that was loaded anew in the middle offers to go on.
    const reloaded = new Guide(notes);
    later.next();
    reloaded.enter(MOUSE);
    reloaded.offer(0);
    expect(reloaded.phase).toBe("offered");
    reloaded.decline();
    const after = new Guide(notes);
    after.enter(MOUSE);
    after.offer(0);
    expect(after.phase).toBe("idle");
    expect(after.resumesAt).toBe(2);
    after.start();
    expect(after.step?.id).toBe("insert");
  });

  it("goes on in the headset with other words, and past steps that are no more", () => {
    const guide = new Guide(new Notes());
    guide.enter(MOUSE);
    guide.start();
    for (let i = 0; i < 4; i++) guide.next();
    const before = wordsOf(guide.step!, guide.situation);
    guide.enter({ ...MOUSE, place: "hands" });
    expect(guide.step?.id).toBe("turn");
    expect(guide.trial.task).toEqual({ kind: "moved", cm: 10 });
    expect(wordsOf(guide.step!, guide.situation)).not.toBe(before);
    guide.enter({ ...MOUSE, place: "hands", free: false, space: false });
    expect(guide.step?.id).toBe("settings");
    expect(guide.phase).toBe("running");
  });

  it("believes nothing strange of an earlier visit, and does without a storage", () => {
    const storage = new Map<string, string>();
    const store = { getItem: (key: string) => storage.get(key) ?? null, setItem: (key: string, value: string) => void storage.set(key, value) };
    const memory = (): StoredMemory => new StoredMemory(store as unknown as Storage);
    for (const text of ["", "null", "7", '{"page":5}', '{"page":{"state":"odd","at":"x"}}', "{"]) {
      storage.set("cathxr.guide", text);
      expect(memory().read("page")).toBeNull();
    }
    memory().write("page", { state: "left", at: "roll" });
    expect(memory().read("page")).toEqual({ state: "left", at: "roll" });
    const none = new StoredMemory(null);
    none.write("page", { state: "finished", at: "" });
    expect(none.read("page")).toEqual({ state: "finished", at: "" });
  });
});

describe("the help", () => {
  it("says for a headset what its hands do, in lines that a plate has room for", () => {
    for (const bare of [false, true]) {
      const lines = headsetLines(bare);
      expect(lines.some((line) => line.includes(bare ? "Pinch" : "grip"))).toBe(true);
      expect(lines.join(" ")).not.toMatch(bare ? /grip|trigger|thumbstick/i : /pinch|palm/i);
      for (const line of lines) expect(line.length, line).toBeLessThan(62);
    }
  });
});
