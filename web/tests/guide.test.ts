import { describe, expect, it } from "vitest";
import type { Memory, Note } from "../src/guide/guide";
import { Guide, LINGER_MS, OFFER_MS } from "../src/guide/guide";
import { StoredMemory } from "../src/guide/memory";
import type { Situation } from "../src/guide/situation";
import { still } from "../src/guide/situation";
import { STEPS, wordsOf } from "../src/guide/steps";
import { headsetLines } from "../src/guide/words";
import { FPS, MOUSE, REST, measure } from "./held";

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
