import { describe, expect, it, vi } from "vitest";
import type { HeartSeed, HeartSeedsState, SlicePlane, Vector3 } from "../src/generated/messages";
import { tiltText } from "../src/heart/act";
import { contoursOf } from "../src/heart/contours";
import { inPlane, isInside, placed, placeText, sizeMm, sliceAt, toCanvas, toCt, toSlice, withPlane, zoomOn } from "../src/heart/geometry";
import { keyAct } from "../src/heart/keys";
import { changeText, disagreement } from "../src/heart/lists";
import { Cache, order, SliceLoader } from "../src/heart/loader";
import { SeedsModel } from "../src/heart/model";
import { offersFor } from "../src/heart/offers";
import { dragged, labelTable, paintCt, paintLabels, windowTable } from "../src/heart/paint";
import { WHOLE } from "../src/calibrate/fit";

const AXIAL: SlicePlane = { name: "axial", columns: 40, rows: 30, slices: 20, spacing_mm: [0.5, 0.5, 2], letters: ["R", "L", "A", "P"] };
const CORONAL: SlicePlane = { name: "coronal", columns: 40, rows: 20, slices: 30, spacing_mm: [0.5, 2, 0.5], letters: ["R", "L", "H", "F"] };
const SAGITTAL: SlicePlane = { name: "sagittal", columns: 30, rows: 20, slices: 40, spacing_mm: [0.5, 2, 0.5], letters: ["A", "P", "H", "F"] };
const SEED: HeartSeed = {
  id: 3, structure: "left_atrium", position_mm: [1, 2, 3], seen: [10, 12, 8], radius_mm: null, hu: 300, labelled: "left_atrium",
};
const STATE: HeartSeedsState = {
  type: "heart_seeds", stage: "ready", advice: "", progress: null, doing: "", planes: [AXIAL, CORONAL, SAGITTAL],
  ct_from_seen: [[0.5, 0, 0], [0, 0.5, 0], [0, 0, -2], [-10, -20, 100]], tilt_deg: 0,
  structures: [
    { key: "left_ventricle", name: "Left ventricle", colour: "#bf3a3a", label: 1, seedable: true, volume_ml: 120, before_ml: null },
    { key: "left_atrium", name: "Left atrium", colour: "#e8917c", label: 3, seedable: true, volume_ml: 80, before_ml: 92.4 },
    { key: "blood_pool", name: "Blood pool", colour: "#c05a6a", label: 13, seedable: false, volume_ml: 5, before_ml: 5 },
  ],
  seeds: [SEED], labels_version: 1, labels_box: [], labels_from: "segmentation", is_current: true, findings: [],
  can_undo: false, can_redo: false, saved: true,
};

function model(state = STATE): SeedsModel {
  const made = new SeedsModel(() => undefined, () => undefined);
  made.take(state);
  return made;
}

describe("geometry", () => {
  it("keeps a slice's true shape, whatever its voxels are", () => {
    expect(sizeMm(CORONAL)).toEqual({ width: 20, height: 40 });
    const at = placed(CORONAL, { width: 400, height: 400 }, WHOLE);
    expect(at.perColumn / at.perRow).toBeCloseTo(0.5 / 2, 12);
    expect([at.left, at.top]).toEqual([100, 0]); // 20 x 40 mm in a square: 10 px a mm
  });

  it("finds the voxel under the pointer again, zoomed or not", () => {
    for (const zoom of [WHOLE, { factor: 3.7, x: 0.31, y: 0.62 }]) {
      const at = placed(CORONAL, { width: 317, height: 211 }, zoom);
      const [column, row] = toSlice(at, toCanvas(at, [12.25, 7.5]));
      expect(column).toBeCloseTo(12.25, 9);
      expect(row).toBeCloseTo(7.5, 9);
    }
    expect(isInside([-0.4, 0], CORONAL)).toBe(true);
    expect(isInside([39.6, 0], CORONAL)).toBe(false);
  });

  it("links the planes: what one plane says of a place, the others show", () => {
    const seen: Vector3 = [10, 12, 8];
    expect(inPlane("axial", seen)).toEqual([10, 12]);
    expect(inPlane("coronal", seen)).toEqual([10, 8]);
    expect(inPlane("sagittal", seen)).toEqual([12, 8]);
    expect(withPlane("sagittal", seen, [1, 2])).toEqual([10, 1, 2]);
    expect(["axial", "coronal", "sagittal"].map((plane) => sliceAt(plane as "axial", [10.4, 12.6, 99], [40, 30, 20]))).toEqual([19, 13, 10]);
  });

  it("gives places in ct, in words a clinician reads", () => {
    expect(toCt(STATE.ct_from_seen, [10, 12, 8])).toEqual([-5, -14, 84]);
    expect(placeText([-5, -14, 84])).toBe("R 5.0  A 14.0  H 84.0 mm");
    expect(placeText([5, 14, -84])).toBe("L 5.0  P 14.0  F 84.0 mm");
  });

  it("enlarges a box until it nearly fills the view, in its middle", () => {
    const canvas = { width: 300, height: 300 };
    const zoom = zoomOn(AXIAL, canvas, [10, 10, 3], [19, 14, 9]);
    const at = placed(AXIAL, canvas, zoom);
    const [left] = toCanvas(at, [9.5, 9.5]);
    const [right] = toCanvas(at, [19.5, 14.5]);
    expect(right - left).toBeCloseTo(0.86 * 300, 6);
    expect((left + right) / 2).toBeCloseTo(150, 6);
  });
});

describe("pixels", () => {
  it("shows a window's middle as middle grey, and nothing beyond its ends", () => {
    const pixels = new Uint32Array(5);
    paintCt(Int16Array.from([-150, 250, 650, -32768, 32767]), windowTable({ centre: 250, width: 800 }), pixels);
    expect([...pixels].map((word) => word & 0xff)).toEqual([0, 128, 255, 0, 255]);
    expect([...pixels].every((word) => word >>> 24 === 255)).toBe(true);
  });

  it("paints a label in its colour, and those that are hidden not at all", () => {
    const pixels = new Uint32Array(3);
    paintLabels(Uint8Array.from([0, 1, 3]), labelTable(new Map([[1, "#bf3a3c"]])), pixels);
    expect([...pixels]).toEqual([0, 0xff3c3abf, 0]); // little-endian: red first
  });

  it("changes brightness and contrast by dragging, within bounds", () => {
    expect(dragged({ centre: 40, width: 400 }, [10, 20])).toEqual({ centre: 60, width: 410 });
    expect(dragged({ centre: 40, width: 12 }, [-999, 0]).width).toBe(10);
  });
});

describe("contours", () => {
  /** Returns the area inside pieces that go round, by the shoelace formula over |x dy|. */
  function closed(ends: readonly number[]): boolean {
    const met = new Map<string, number>();
    for (let n = 0; n < ends.length; n += 2) met.set(`${ends[n]} ${ends[n + 1]}`, (met.get(`${ends[n]} ${ends[n + 1]}`) ?? 0) + 1);
    return [...met.values()].every((count) => count % 2 === 0);
  }

  it("go round every label, closed also at the slice's edge", () => {
    const labels = Uint8Array.from([1, 1, 0, 2, 1, 0, 0, 2, 0, 3, 3, 2]);
    const found = contoursOf(labels, 4, 3);
    expect([...found.keys()].sort()).toEqual([1, 2, 3]);
    for (const ends of found.values()) expect(closed(ends)).toBe(true);
  });

  it("run half a voxel from a voxel's middle", () => {
    const ends = contoursOf(Uint8Array.from([0, 0, 0, 0, 7, 0, 0, 0, 0]), 3, 3).get(7)!;
    expect(ends.length).toBe(16); // a diamond
    for (let n = 0; n < ends.length; n += 2) expect(Math.hypot(ends[n]! - 1, ends[n + 1]! - 1)).toBeCloseTo(0.5, 12);
  });

  it("keep two that touch at a corner apart", () => {
    expect(contoursOf(Uint8Array.from([1, 0, 0, 1]), 2, 2).get(1)!.length).toBe(32);
  });
});

describe("slices are loaded", () => {
  it("the wanted one first, then ahead in the direction of scrolling", () => {
    expect(order({ wanted: 5, direction: -1, slices: 100 })).toEqual([5, 4, 3, 2, 6]);
    expect(order({ wanted: 0, direction: -1, slices: 100 })).toEqual([0, 1]);
  });

  it("each once, and those of older labels never", async () => {
    const asked: string[] = [];
    const answers = new Map<string, (data: ArrayBuffer) => void>();
    const read = (path: string): Promise<ArrayBuffer> => {
      asked.push(path);
      return new Promise((done) => answers.set(path, done));
    };
    const loader = new SliceLoader(read, (data) => new Uint8Array(data), { onSlice: vi.fn(), onTrouble: vi.fn() }, "labels/1");
    expect(loader.want("axial", 4, 9)).toBeNull();
    expect(loader.want("axial", 4, 9)).toBeNull();
    expect(asked).toEqual(["labels/1/axial/4.bin", "labels/1/axial/5.bin"]);
    loader.from("labels/2");
    answers.get("labels/1/axial/4.bin")!(new ArrayBuffer(3)); // too late
    await new Promise((done) => setTimeout(done));
    expect(loader.want("axial", 4, 9)).toBeNull();
    answers.get("labels/2/axial/4.bin")!(new ArrayBuffer(2));
    await new Promise((done) => setTimeout(done));
    expect(loader.want("axial", 4, 9)?.length).toBe(2);
  });

  it("and kept while there is room, the longest unused goes first", () => {
    const cache = new Cache<Uint8Array>(10);
    for (const [key, bytes] of [["a", 4], ["b", 4]] as const) cache.put(key, new Uint8Array(bytes));
    cache.get("a");
    cache.put("c", new Uint8Array(4));
    expect([cache.has("a"), cache.has("b"), cache.has("c")]).toEqual([true, false, true]);
  });
});

describe("what is said", () => {
  it("offers what helps most first, and asks before work is lost", () => {
    const names = (state: HeartSeedsState): string[] => offersFor(state, "").map((each) => `${each.label}${each.kind === "primary" ? "!" : ""}`);
    expect(names(STATE)).toEqual(["Done!", "Segment again"]);
    expect(names({ ...STATE, saved: false })).toEqual(["Save seeds!", "Segment again", "Done"]);
    expect(names({ ...STATE, saved: false, is_current: false })).toEqual(["Segment again!", "Save seeds", "Done"]);
    expect(names({ ...STATE, stage: "segmenting" })).toEqual(["Stop", "Done"]);
    expect(offersFor({ ...STATE, saved: false }, "").find((each) => each.command === "seeds_done")!.confirm).not.toBe("");
    expect(offersFor(STATE, "Pair first.").every((each) => each.why === "Pair first.")).toBe(true);
  });

  it("names a seed that the labels contradict, and by how much a volume changed", () => {
    expect(disagreement(SEED, model())).toBe("");
    expect(disagreement({ ...SEED, labelled: "left_ventricle" }, model())).toBe("labelled left ventricle");
    expect(disagreement({ ...SEED, labelled: "" }, model())).toBe("labelled as nothing");
    expect(disagreement({ ...SEED, structure: "none", labelled: "" }, model())).toBe("");
    expect(STATE.structures.map(changeText)).toEqual(["", "−12", ""]);
    expect([tiltText(STATE), tiltText({ ...STATE, tilt_deg: 23.4 })]).toEqual(["", "oblique: 23° to the patient's axes"]);
  });

  it("keys move the cursor in the plane that was used last", () => {
    const key = (name: string, more = {}): ReturnType<typeof keyAct> =>
      keyAct({ key: name, shiftKey: false, ctrlKey: false, metaKey: false, altKey: false, ...more }, "sagittal");
    expect(key("ArrowRight")).toEqual({ act: "cursor", step: [0, 1, 0] });
    expect(key("PageDown", { shiftKey: true })).toEqual({ act: "cursor", step: [10, 0, 0] });
    expect(key("3")).toEqual({ act: "choose", number: 3 });
    expect(key("z", { ctrlKey: true })).toEqual({ act: "undo" });
    expect(key("Z", { ctrlKey: true, shiftKey: true })).toEqual({ act: "redo" });
    expect(key("Enter", { shiftKey: true })).toEqual({ act: "add" });
    expect(key("x")).toBeNull();
  });
});

describe("the page's model", () => {
  it("begins in the scan's middle and stays inside it", () => {
    const made = model();
    expect(made.cursor).toEqual([19, 14, 9]);
    made.look([-5, 99, 3]);
    expect(made.cursor).toEqual([0, 29, 3]);
  });

  it("takes hold of a structure's own seed, and hints at seeds a few millimetres off", () => {
    const made = model();
    made.choose("left_atrium");
    expect(made.selected).toBe(3);
    made.look([10, 12, 10]);
    expect(made.seedsNear("axial").map(({ off }) => off)).toEqual([2]); // 4 mm
    made.look([10, 12, 12]);
    expect(made.seedsNear("axial")).toEqual([]); // 8 mm
    made.take({ ...STATE, seeds: [] });
    expect(made.selected).toBeNull();
  });

  it("hides what a person has hidden", () => {
    const made = model();
    made.hidden.add("left_atrium");
    expect([...made.visible().keys()]).toEqual([1, 13]);
  });
});
