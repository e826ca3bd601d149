import { describe, expect, it } from "vitest";
import { Choice } from "../src/training/choice";
import { TrainingModel } from "../src/training/model";
import { lines, trainingRows } from "../src/training/xr/rows";
import type { Row } from "../src/xr/menu_model";
import { ROWS_SHOWN } from "../src/xr/menu_model";
import { figures, item, offer, run, state, survey } from "./training-states";

function rows(change: Parameters<typeof state>[0], { operating = true, trouble = "", study = "" } = {}): Row[] {
  const model = new TrainingModel();
  model.setRole(true, operating);
  model.takeOffer(offer(study === "" ? {} : { study, participants: [{ code: "P01", next: "2D, trial 1", done: false }] }));
  model.takeState(state(change), 0);
  const choice = new Choice(model);
  choice.participant = "P01";
  return trainingRows({ model, choice, desk: { trouble, busy: false }, replay: { player: null } });
}

const labels = (found: Row[]): string[] => found.flatMap((row) => (row.kind === "buttons" ? row.buttons.map(({ label }) => label) : []));

describe("the headset's rows of training", () => {
  it("choose and start outside a study", () => {
    const found = rows({});
    expect(found.map(({ label }) => label)).toEqual(["Who", "Task", "View", "Trial"]);
    expect(labels(found)).toEqual(["‹", "P01", "›", "Type", "‹", "One", "›", "3D", "2D", "free", "Start", "Prepare"]);
    expect(found.at(-1)!.locked).toBeNull();
  });

  it("leave task and view to a study", () => {
    const found = rows({}, { study: "A study" });
    expect(found.map(({ label }) => label)).toEqual(["Who", "Next: 2D, trial 1", "Trial"]);
  });

  it("have what a trial under way allows", () => {
    expect(labels(rows({ phase: "ready", run: run(), can: ["training_begin"] }))).toEqual(["Start", "Put away"]);
    expect(labels(rows({ phase: "running", run: run(), now: figures(), can: ["training_pause"] }))).toEqual(["Pause", "Abort"]);
    expect(labels(rows({ phase: "paused", run: run(), now: figures(), can: ["training_resume"] }))).toEqual(["Go on", "Abort"]);
  });

  it("give a viewer no button, and say how to pair", () => {
    for (const phase of ["idle", "running", "ended"] as const) {
      const found = rows({ phase, run: run(), now: figures() }, { operating: false });
      expect(labels(found)).toEqual([]);
      expect(found.map(({ label }) => label).join(" ")).toContain("pairing code");
    }
  });

  it("fit the menu's page with a survey and trouble", () => {
    const long = "The store is locked by another program: close it, or give another file with --store, and try again then.";
    const found = rows({ survey: survey([item("q1")]), result: null, phase: "idle" }, { trouble: long });
    expect(found.length).toBeLessThanOrEqual(ROWS_SHOWN);
    expect(labels(found)).toContain("Answer");
  });

  it("break a sentence into lines that are not too long", () => {
    const found = lines("one two three ".repeat(20)).map(({ label }) => label);
    expect(found.every((each) => each.length <= 54)).toBe(true);
    expect(found.join(" ")).toBe("one two three ".repeat(20).trim());
  });
});
