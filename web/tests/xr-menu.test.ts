import { describe, expect, it } from "vitest";
import { CONTROLS } from "../src/stage/controls";
import { SettingsStore } from "../src/stage/settings";
import type { RollView } from "../src/ui/roll";
import { hudLines, noticeOf } from "../src/xr/hud_words";
import { controlRect, EM, HEIGHT, labelRect, rowRect, segments, shareAlong, spotAt, switchRect, tabRects, trackRect, WIDTH } from "../src/xr/menu_layout";
import type { Row, Situation } from "../src/xr/menu_model";
import { nextArm, ROWS_SHOWN, rowsOf, slid, TABS, toggled } from "../src/xr/menu_model";

function situation(parts = 12): Situation {
  const store = new SettingsStore();
  return {
    store, helpLines: ["one", "two"], canGuide: true, target: { name: "Fossa ovalis", own: false, number: 2, count: 5 }, tip: true, training: () => [],
    roll: null,
    parts: Array.from({ length: parts }, (_, index) => ({ name: `part_${index}`, label: `Part ${index}` })),
  };
}

describe("the menu", () => {
  it("offers every setting of the page that has a meaning now", () => {
    const now = situation(0);
    now.store.set({ ice: true });
    const labels = new Set(TABS.flatMap((tab) => [0, 1, 2].flatMap((page) => rowsOf(tab, page, now).rows.map((row) => row.label))));
    for (const { label, shown } of CONTROLS) if (shown?.(now.store.value) ?? true) expect(labels).toContain(label);
  });

  it("has every part of the heart on some page, and never more rows than there is room for", () => {
    const now = situation();
    const { pages } = rowsOf("Parts", 0, now);
    const seen: string[] = [];
    for (let page = 0; page < pages; page++) {
      const { rows } = rowsOf("Parts", page, now);
      expect(rows.length).toBeLessThanOrEqual(ROWS_SHOWN);
      seen.push(...rows.map((row) => row.label));
    }
    for (const { label } of now.parts) expect(seen.filter((each) => each === label)).toHaveLength(1);
  });

  it("changes settings by steps within their limits", () => {
    const now = situation(0);
    const row = rowsOf("Heart", 0, now).rows.find((each) => each.kind === "slider");
    if (row?.kind !== "slider") throw new Error("no slider");
    expect(slid(row, -1)).toEqual({ [row.key]: row.low });
    expect(slid(row, 2)).toEqual({ [row.key]: row.high });
    const half = Object.values(slid(row, 0.503))[0] as number;
    expect(half).toBeCloseTo(row.low + Math.round((0.503 * (row.high - row.low)) / row.step) * row.step, 6);
    const hud = rowsOf("View", 0, now).rows.find((each) => each.kind === "toggle" && each.key === "hud");
    if (hud?.kind !== "toggle") throw new Error("no toggle");
    now.store.set(toggled(hud, now.store.value));
    expect(now.store.value.hud).toBe(false);
  });

  it("lets the wearer put the roll right, or says why nobody can here", () => {
    const now = situation(0);
    const invalid: RollView = {
      legend: "roll not valid", beam: false, detail: "Roll not valid: the encoder restarted.", hint: "",
      action: { command: "roll_confirm", label: "Confirm roll" },
    };
    const ask = (roll: RollView | null): Row[] => rowsOf("Ultrasound", 0, { ...now, roll }).rows.filter(({ label }) => label !== "");
    const without = ask(null).length;
    const [why, mend] = ask(invalid);
    expect(why).toMatchObject({ kind: "text", label: invalid.detail });
    if (mend?.kind !== "buttons") throw new Error("no button");
    expect(mend.buttons).toEqual([{ label: "Confirm roll", act: { roll: true } }]);
    const viewer = ask({ ...invalid, action: null, hint: "An operator can do this, at the page or with a headset that is paired." });
    expect(viewer.slice(0, 2).map(({ kind }) => kind)).toEqual(["text", "text"]);
    for (const { label } of viewer) expect(label.length).toBeLessThanOrEqual(62);
    expect(viewer.some((row) => row.label === "Roll")).toBe(false);
    expect(ask({ ...invalid, detail: "", action: null })).toHaveLength(without);
  });

  it("says why a setting is held", () => {
    const now = situation(0);
    now.store.hold({ values: { mode: "3d" }, sentence: "The exercise holds this." });
    const [first] = rowsOf("View", 0, now).rows;
    expect(first?.locked).toBe("The exercise holds this.");
    expect(rowsOf("View", 0, now).rows.filter((row) => row.locked !== null)).toHaveLength(1);
  });

  it("has everything inside its frame, nothing over another, and finds what is under a pointer", () => {
    const now = situation();
    now.store.set({ ice: true });
    for (const tab of TABS) {
      const { rows } = rowsOf(tab, 0, now);
      rows.forEach((row, index) => {
        const rect = rowRect(index);
        expect(rect.y + rect.h).toBeLessThanOrEqual(HEIGHT - 36);
        expect(spotAt(rows, rect.x + rect.w / 2, rect.y + rect.h / 2)).toMatchObject({ kind: "row", index });
        if (row.kind === "text") return;
        const [label, control] = [labelRect(row, rect), controlRect(row, rect)];
        expect(label.x + label.w).toBeLessThanOrEqual(control.x);
        expect(control.x + control.w).toBeLessThanOrEqual(rect.x + rect.w);
        if (row.kind === "choice" || row.kind === "buttons") {
          segments(row, rect).forEach((each, segment) => {
            expect(spotAt(rows, each.x + each.w / 2, each.y + each.h / 2)).toMatchObject({ kind: "row", index, segment });
          });
        }
        if (row.kind === "slider") expect(trackRect(control).w).toBeGreaterThan(100);
      });
    }
    for (const { tab, rect } of tabRects()) {
      expect(spotAt([], rect.x + 2, rect.y + 2)).toMatchObject({ kind: "tab", tab });
      expect(rect.x + rect.w).toBeLessThanOrEqual(WIDTH);
    }
  });

  it("has capitals of one degree at arm's length: 0.6 degrees can be read", () => {
    const degrees = (Math.atan((0.7 * EM.small) / 1000 / 0.6) * 180) / Math.PI;
    expect(degrees).toBeGreaterThan(1);
  });

  it("lets each part be hidden and have an opacity of its own", () => {
    const now = situation();
    now.store.setPart("part_1", { visible: false, opacity: 0.4 });
    const { rows } = rowsOf("Parts", 0, now);
    const row = rows.find(({ label }) => label === "Part 1");
    expect(row).toMatchObject({ kind: "part", part: "part_1", on: false, opacity: 0.4, locked: null });
    const index = rows.indexOf(row!);
    const rect = rowRect(index);
    const [slider, knob] = [controlRect(row!, rect), switchRect(rect)];
    expect(spotAt(rows, slider.x + 5, rect.y + 5)).toMatchObject({ index, segment: 0 });
    expect(spotAt(rows, knob.x + 5, rect.y + 5)).toMatchObject({ index, segment: 1 });
    expect(shareAlong(row!, index, trackRect(slider).x + trackRect(slider).w / 2)).toBeCloseTo(0.5, 6);
    now.store.hold({ values: { parts: {} }, sentence: "Held." });
    expect(rowsOf("Parts", 0, now).rows.filter(({ kind }) => kind === "part").every(({ locked }) => locked === "Held.")).toBe(true);
  });

  it("steps through the targets, adds one at the tip, and removes only what somebody added", () => {
    const now = situation();
    const act = (label: string): Row => rowsOf("Targets", 0, now).rows.find((row) => row.label === label)!;
    expect(act("Add").locked).toBe("Switch Targets on first.");
    now.store.set({ targets: true });
    expect(rowsOf("Targets", 0, now).rows.map(({ label }) => label)).toContain("Fossa ovalis (2 of 5)");
    expect([act("In force").locked, act("Add").locked, act("Remove").locked]).toEqual([null, null, "This one belongs to the scene: it stays."]);
    expect(act("In force")).toMatchObject({ buttons: [{ act: { target: "previous" } }, { act: { target: "next" } }] });
    const own = { ...now, tip: false, target: { ...now.target!, own: true } };
    expect(rowsOf("Targets", 0, own).rows.find(({ label }) => label === "Remove")!.locked).toBeNull();
    expect(rowsOf("Targets", 0, own).rows.find(({ label }) => label === "Add")!.locked).toBe("The tip is not tracked now.");
  });

  it("has the X-ray arms' usual angles while the flat pictures are shown", () => {
    const now = situation(0);
    const arms = (): Row[] => rowsOf("View", 0, now).rows.filter(({ label }) => label.startsWith("Arm "));
    expect(arms()).toHaveLength(0);
    now.store.set({ mode: "2d" });
    expect(arms()).toHaveLength(2);
    expect(nextArm({ laoDeg: 0, cranialDeg: 0 }, 1)).toEqual({ laoDeg: -30, cranialDeg: 0 });
    expect(nextArm({ laoDeg: 0, cranialDeg: 0 }, -1)).toEqual({ laoDeg: 45, cranialDeg: 20 });
    expect(nextArm({ laoDeg: 12, cranialDeg: 3 }, 1)).toEqual({ laoDeg: 0, cranialDeg: 0 });
  });
});

describe("the numbers", () => {
  const wall = { state: "off", count: 0, depthMm: 0 } as const;

  it("say what is known and leave out what is not", () => {
    const status = { label: "coasting: hidden", level: "warn" } as const;
    const bare = hudLines({ status, insertedMm: null, rollRad: null, canMendRoll: false, delayMs: null, target: null, wall });
    expect(bare).toEqual([{ left: { text: "Coasting: hidden", tone: "warn" }, right: null }]);
    const target = {
      name: "LAA", by: "tip", distanceMm: 7.26, angleDeg: 30, beamDistanceMm: 12.7, beamAngleDeg: 12.4,
      near: true, aligned: true, within: true, dwelt: 0.5, reached: false,
    } as const;
    const lines = hudLines({
      status, insertedMm: 83.4, rollRad: -Math.PI / 2, canMendRoll: true, delayMs: 41.6, target, wall: { state: "ready", count: 2, depthMm: 1.25 },
    });
    expect(lines.map(({ left, right }) => `${left.text}|${right?.text ?? ""}`)).toEqual([
      "Coasting: hidden|42 ms behind", "83 mm inserted|roll −90°", "To LAA|", "tip 7.3 mm 30°|beam 13 mm 12°", "In the wall, 1.3 mm deep|",
    ]);
    const unknown = hudLines({ status, insertedMm: 83, rollRad: null, canMendRoll: true, delayMs: null, target: null, wall });
    expect(unknown.at(1)?.right).toEqual({ text: "roll not valid: see the menu", tone: "warn" });
    const byBeam = hudLines({ status, insertedMm: null, rollRad: null, canMendRoll: false, delayMs: null, target: { ...target, by: "beam" }, wall });
    expect(byBeam.at(-1)).toMatchObject({ left: { text: "beam 13 mm 12°" }, right: { text: "tip 7.3 mm 30°" } });
  });

  it("say large that the link is lost, and leave a lost catheter to the small ones", () => {
    const banner = { title: "The link is lost", detail: "It broke.", hint: "Trying again in 3 s. What is drawn is the last that came." };
    expect(noticeOf({ label: "link lost", banner })).toEqual({
      title: "Link lost, trying again", detail: "Trying again in 3 s.", hint: "What is drawn is the last that came.",
    });
    expect(noticeOf({ label: "lost", banner })).toBeNull();
    expect(noticeOf({ label: "tracked", banner: null })).toBeNull();
  });
});
