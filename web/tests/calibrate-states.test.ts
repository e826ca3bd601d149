import { describe, expect, it } from "vitest";
import { offersFor } from "../src/calibrate/buttons";
import { cellAlpha, cellBox, filled } from "../src/calibrate/coverage";
import { endingOf } from "../src/calibrate/ending";
import { CAPTURED_MS, CaptureWatch, lookOf, lookWords } from "../src/calibrate/intrinsics_look";
import { wordsFor } from "../src/calibrate/marker_list";
import { MarkerModel } from "../src/calibrate/marker_model";
import { HOLD_MS, Matcher } from "../src/calibrate/matcher";
import { Placer } from "../src/calibrate/placer";
import type { CamerasState, IntrinsicsState, MarkersState, MarkerState } from "../src/generated/messages";
import type { Answer } from "../src/link/commands";

const LENS: IntrinsicsState = {
  type: "calibrate_intrinsics", camera: "top", stage: "collecting", advice: "Hold it.", size_px: [1280, 720],
  corners_px: [[1, 2]], corners_seq: 5, is_still: false, is_new: true,
  coverage: { columns: 8, rows: 5, counts: new Array<number>(40).fill(0) }, kept: 4, wanted: 20, views: [], figures: [], pictures: [],
};
const SEEN: Omit<MarkerState, "name"> = { camera: "top", colour: "red", pixel: [10, 20], origin: "found", residual: [0.03, 0.04], residual_px: 0.05 };
const NOT_SEEN = { ...SEEN, pixel: null, origin: "missing", residual: null, residual_px: null } as const;
const MARKERS: MarkersState = {
  type: "calibrate_markers", stage: "done", advice: "Good.", sizes_px: { top: [1280, 720], front: [640, 480] }, can_save: true,
  markers: [
    { ...SEEN, name: "mT1" }, { ...NOT_SEEN, name: "mT2" }, { ...SEEN, name: "mT3", pixel: [100, 20] },
    { ...NOT_SEEN, name: "mT4" }, { ...NOT_SEEN, camera: "front", name: "mT1" },
  ],
  figures: [], pictures: [],
};
const CAMERAS: CamerasState = { type: "calibrate_cameras", stage: "collecting", advice: "", devices: [], can_save: false, figures: [] };

describe("coverage", () => {
  it("lays the cells over the whole picture, row by row", () => {
    const size = { width: 1280, height: 720 };
    expect(cellBox(LENS.coverage, 0, size)).toEqual({ left: 0, top: 0, width: 160, height: 144 });
    expect(cellBox(LENS.coverage, 9, size)).toEqual({ left: 160, top: 144, width: 160, height: 144 });
    const last = cellBox(LENS.coverage, 39, size);
    expect([last.left + last.width, last.top + last.height]).toEqual([1280, 720]);
  });

  it("is the stronger the more corners were there, and never hides the picture", () => {
    expect(cellAlpha(0)).toBe(0);
    let before = 0;
    for (const count of [1, 2, 5, 20, 1000]) {
      expect(cellAlpha(count)).toBeGreaterThan(before);
      before = cellAlpha(count);
    }
    expect(before).toBeLessThan(0.5);
    expect(filled({ columns: 2, rows: 2, counts: [0, 3, 0, 1] })).toEqual({ filled: 2, of: 4 });
  });
});

describe("what a person with a board is told", () => {
  it("searches, says to hold still, then that it captures", () => {
    expect(lookOf({ ...LENS, corners_px: [] }, Infinity)).toBe("searching");
    expect(lookOf({ ...LENS, is_new: false }, Infinity)).toBe("known");
    expect(lookOf(LENS, Infinity)).toBe("hold");
    expect(lookOf({ ...LENS, is_still: true }, Infinity)).toBe("capturing");
    expect(lookOf(LENS, CAPTURED_MS - 1)).toBe("captured");
    expect(lookOf({ ...LENS, stage: "solving" }, 0)).toBe("solving");
    expect(lookWords("hold")).toBe("Hold still");
  });

  it("notices each capture once, and none that it has not seen", () => {
    const watch = new CaptureWatch();
    expect(watch.take(LENS, 0)).toBe(false); // the first state: kept before this page came
    expect(watch.take({ ...LENS, kept: 5 }, 100)).toBe(true);
    expect(watch.since(150)).toBe(50);
    expect(watch.take({ ...LENS, kept: 5 }, 200)).toBe(false);
    expect(watch.take({ ...LENS, kept: 4 }, 300)).toBe(false); // one was discarded
    expect(watch.take({ ...LENS, kept: 9, camera: "front" }, 400)).toBe(false);
    watch.forget();
    expect(watch.take({ ...LENS, kept: 30, camera: "front" }, 500)).toBe(false);
    expect(watch.since(500)).toBe(Infinity);
  });
});

describe("Matcher", () => {
  it("shows each picture with its own corners while they come, and the newest picture when they do not", () => {
    const released: number[] = [];
    const matcher = new Matcher<{ seq: number }>((picture) => released.push(picture.seq));
    expect(matcher.put({ seq: 1 }, 0)).toBe(true); // nothing is known of corners yet
    matcher.want(1, 10);
    expect(matcher.put({ seq: 2 }, 40)).toBe(false);
    expect(matcher.put({ seq: 3 }, 70)).toBe(false);
    expect(matcher.want(3, 110)).toBe(true);
    expect(matcher.shown?.seq).toBe(3);
    expect(released).toEqual([2, 1]);
    matcher.want(4, 120); // the corners came before the picture
    expect(matcher.put({ seq: 4 }, 140)).toBe(true);
    expect(matcher.put({ seq: 5 }, 150)).toBe(false);
    expect(matcher.put({ seq: 6 }, 140 + HOLD_MS)).toBe(true);
    expect(matcher.shown?.seq).toBe(6);
    matcher.clear();
    expect([...released].sort()).toEqual([1, 2, 3, 4, 5, 6]); // each one once: its memory is not the collector's
  });

  it("goes back to lower numbers when the server has been started again", () => {
    const matcher = new Matcher<{ seq: number }>(() => undefined);
    matcher.put({ seq: 900 }, 0);
    matcher.want(900, 0);
    expect(matcher.put({ seq: 1 }, HOLD_MS + 1)).toBe(true);
    expect(matcher.shown?.seq).toBe(1);
  });
});

describe("MarkerModel", () => {
  it("shows a marker where a person moves it until the server has it", () => {
    const model = new MarkerModel();
    model.take(MARKERS);
    expect(model.size("front")).toEqual({ width: 640, height: 480 });
    expect(model.of("top").map((marker) => marker.name)).toEqual(["mT1", "mT2", "mT3", "mT4"]);
    model.move("top/mT2", [7, 8]);
    expect(model.find("top/mT2")).toMatchObject({ pixel: [7, 8], moving: true, residual_px: null });
    model.take(MARKERS);
    expect(model.find("top/mT2")!.pixel).toEqual([7, 8]);
    model.release("top/mT2");
    expect(model.find("top/mT2")).toMatchObject({ pixel: null, moving: false });
  });

  it("goes on to the next missing marker of the same camera", () => {
    const model = new MarkerModel();
    model.take(MARKERS);
    expect(model.nextMissing("top/mT2")).toBe("top/mT4");
    expect(model.nextMissing("top/mT4")).toBe("top/mT2");
    expect(model.nextMissing("front/mT1")).toBeNull();
    model.move("top/mT4", [1, 1]);
    expect(model.nextMissing("top/mT2")).toBeNull();
  });

  it("finds the nearest marker within reach, and lets a selection go that is there no more", () => {
    const model = new MarkerModel();
    model.take(MARKERS);
    expect(model.nearest("top", [98, 21], 10)).toBe("top/mT3");
    expect(model.nearest("top", [60, 20], 10)).toBeNull();
    model.selected = "top/mT3";
    model.take({ ...MARKERS, markers: MARKERS.markers.slice(0, 2) });
    expect(model.selected).toBeNull();
  });

  it("says each marker's state in words", () => {
    const model = new MarkerModel();
    model.take(MARKERS);
    expect(model.of("top").map(wordsFor)).toEqual(["found, 0.05 px", "missing: place it", "found, 0.05 px", "missing: place it"]);
  });
});

describe("Placer", () => {
  it("has one command on its way at a time, and sends the newest place of each marker", async () => {
    const asked: unknown[] = [];
    const settled: string[] = [];
    const answers: ((answer: Answer) => void)[] = [];
    const placer = new Placer({
      ask: (name, args) => {
        asked.push([name, args]);
        return new Promise((resolve) => answers.push(resolve));
      },
      onSettled: (key, answer) => settled.push(`${key} ${answer.done}`),
    });
    const wish = { camera: "top", marker: "mT1", exact: true };
    placer.place("top/mT1", { ...wish, pixel: [1, 1] });
    placer.place("top/mT1", { ...wish, pixel: [2, 2] });
    placer.place("top/mT1", { ...wish, pixel: [3, 3] });
    expect(asked).toEqual([["calibration_place", { ...wish, pixel: [1, 1] }]]);
    expect(placer.waits("top/mT1")).toBe(true);
    answers[0]!({ done: true, result: {} });
    await Promise.resolve();
    await Promise.resolve();
    expect(asked[1]).toEqual(["calibration_place", { ...wish, pixel: [3, 3] }]);
    expect(settled).toEqual([]); // a newer place was waiting
    answers[1]!({ done: false, sentence: "Not there." });
    await Promise.resolve();
    await Promise.resolve();
    expect(settled).toEqual(["top/mT1 false"]);
    expect(placer.waits("top/mT1")).toBe(false);
  });
});

describe("buttons", () => {
  const commands = (offers: { command: string }[]): string[] => offers.map((offer) => offer.command.replace("calibration_", ""));

  it("offers what each stage allows, the most important first", () => {
    expect(commands(offersFor(LENS, ""))).toEqual(["capture", "finish", "cancel"]);
    expect(commands(offersFor({ ...LENS, kept: 20 }, ""))).toEqual(["finish", "capture", "cancel"]);
    expect(commands(offersFor({ ...LENS, stage: "solving" }, ""))).toEqual(["cancel"]);
    expect(commands(offersFor({ ...LENS, stage: "done" }, ""))).toEqual(["accept", "continue", "cancel"]);
    expect(commands(offersFor({ ...LENS, stage: "failed" }, ""))).toEqual(["continue", "cancel"]);
    expect(commands(offersFor(MARKERS, ""))).toEqual(["accept", "cancel"]);
    expect(commands(offersFor(CAMERAS, ""))).toEqual(["accept", "finish", "cancel"]);
    expect(commands(offersFor({ ...CAMERAS, stage: "done" }, ""))).toEqual(["accept", "continue", "cancel"]);
  });

  it("says why something cannot be pressed, to a viewer for everything", () => {
    expect(offersFor(LENS, "").map((offer) => offer.why)).toEqual(["", "", ""]);
    expect(offersFor({ ...LENS, corners_px: [], kept: 0 }, "").map((offer) => offer.why !== "")).toEqual([true, true, false]);
    expect(offersFor({ ...MARKERS, can_save: false }, "")[0]!.why).toContain("missing");
    expect(offersFor({ ...MARKERS, stage: "solving" }, "")[0]!.why).not.toBe("");
    expect(offersFor(LENS, "Viewing only.").every((offer) => offer.why === "Viewing only.")).toBe(true);
  });

  it("asks before work is thrown away", () => {
    const cancel = (state: IntrinsicsState): string => offersFor(state, "").at(-1)!.confirm;
    expect(cancel(LENS)).not.toBe("");
    expect(cancel({ ...LENS, kept: 0 })).toBe("");
  });
});

describe("ending", () => {
  it("is what the server says, and none while it goes on", () => {
    expect(endingOf({ saved: true, sentence: "Written." })).toEqual({ saved: true, title: "Saved", sentence: "Written." });
    expect(endingOf({ saved: false, sentence: "Nothing." })).toMatchObject({ saved: false, title: "Cancelled" });
    expect(endingOf({ saved: false })).toBeNull();
    expect(endingOf({})).toBeNull();
  });
});
