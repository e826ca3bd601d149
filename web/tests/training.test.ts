import { describe, expect, it } from "vitest";
import { guideStepOf } from "../src/follow/reporter";
import { Choice } from "../src/training/choice";
import { asCode, codeTrouble } from "../src/training/code";
import { Desk } from "../src/training/desk";
import { TrainingModel } from "../src/training/model";
import { RunPlayer } from "../src/training/run_player";
import { spark } from "../src/training/spark";
import { labelOf, missing, SurveyWalk, valuesOf } from "../src/training/survey";
import { beads, timeColour } from "../src/training/time_colours";
import { chiefLines, countWords, errorWords, fitted, shortName, standingWords, taskWords, timeLeft, tookWords, trend, valueWords } from "../src/training/words";
import { TRIAL_AHEAD_M, TRIAL_EM } from "../src/training/xr/trial_plate";
import { figures, item, line, offer, path, run, state, survey, target } from "./training-states";

function modelOf(...states: Parameters<typeof state>): TrainingModel {
  const model = new TrainingModel();
  model.setRole(true, true);
  model.takeOffer(offer());
  model.takeState(state(...states), 0);
  return model;
}

describe("a participant's code", () => {
  it.each(["P01", "EXP12", "N-07", "SIM001", "A1"])("%s is a good one", (code) => expect(codeTrouble(code)).toBe(""));
  it.each(["", "P", "anna", "ANNA1", "19800504", "P2001", "A1-B2-C3", "P_1", "A".repeat(13), "P--1"])("%s is none", (code) => {
    expect(codeTrouble(code)).toMatch(/^[A-Z\d].*\.$/);
  });
  it("is written in capitals", () => expect(asCode(" p01 ")).toBe("P01"));
});

describe("the choice", () => {
  it("asks for participant, task and view outside a study, and for the participant within one", () => {
    const model = modelOf();
    const choice = new Choice(model);
    expect(choice.trouble).toContain("Whose trial");
    choice.participant = "p07";
    expect(choice.args()).toEqual({ participant: "P07", task: "one", view: "2d" });
    choice.view = "free";
    choice.chooseTask("two");
    expect(choice.args()).toEqual({ participant: "P07", task: "two", view: "3d" });
    model.takeOffer(offer({ study: "A study" }));
    expect(choice.trouble).toBe("P07 is not enrolled in this study.");
    choice.stepParticipant(1);
    expect([choice.args(), choice.trouble]).toEqual([{ participant: "P01" }, ""]);
    choice.stepParticipant(-1);
    expect(choice.participant).toBe("P02");
  });

  it("begins with the first participant of a study who has something to do", () => {
    const model = modelOf();
    const choice = new Choice(model);
    expect(choice.participant).toBe("");
    model.takeOffer(offer({ study: "S", participants: [{ code: "P01", next: "", done: true }, { code: "P02", next: "x", done: false }] }));
    expect([choice.participant, choice.trouble]).toEqual(["P02", ""]);
    choice.participant = "P01";
    expect(choice.trouble).toBe("The study has nothing more for P01.");
  });

  it("goes round the tasks and says why one cannot be done", () => {
    const choice = new Choice(modelOf());
    choice.participant = "P01";
    choice.stepTask(-1);
    expect([choice.task?.key, choice.trouble]).toEqual(["bad", "No landmark."]);
    choice.stepTask(1);
    expect(choice.task?.key).toBe("one");
  });
});

describe("what is known of a trial", () => {
  it("tells of each target once, and not of those of another trial", () => {
    const model = modelOf({ phase: "running", run: run(), now: figures() });
    const told: string[] = [];
    model.onReached = ({ key }) => told.push(key);
    const next = state({ phase: "running", run: run(), now: figures({ target: "b", number: 2, reached: 1 }) });
    model.takeState(next, 100);
    model.takeState(next, 200);
    expect(told).toEqual(["a"]);
    model.takeState(state({ phase: "ended", run: run(), now: figures({ target: null, reached: 2 }) }), 300);
    expect(told).toEqual(["a", "b"]);
    model.takeState(state({ phase: "running", run: run({ id: "trial-2" }), now: figures({ reached: 5 }) }), 400);
    expect(told).toEqual(["a", "b"]);
  });

  it("calls its listeners for changes, not for figures", () => {
    const model = modelOf({ phase: "running", run: run(), now: figures() });
    let calls = 0;
    model.listen(() => (calls += 1));
    model.takeState(state({ phase: "running", run: run(), now: figures({ distance_mm: 3, remaining_s: 99, progress: 0.5 }) }), 100);
    expect([calls, model.now?.distance_mm]).toEqual([0, 3]);
    model.takeState(state({ phase: "running", run: run(), now: figures({ hindrance: "Not seen." }) }), 200);
    model.takeState(state({ phase: "paused", run: run(), now: figures({ hindrance: "Not seen." }) }), 300);
    expect(calls).toBe(2);
  });

  it("counts down by itself between states", () => {
    const model = modelOf({ phase: "countdown", countdown_s: 3, run: run() });
    expect([model.countdownS(1000), model.countdownS(2999.5), model.countdownS(9000)]).toEqual([2, 0.0005, 0].map((each) => expect.closeTo(each, 6)));
    expect(model.target?.key).toBe("a");
    model.takeState(state({ phase: "running", run: run(), now: figures() }), 3000);
    expect(model.countdownS(3100)).toBeNull();
  });

  it("commands only with a link, as an operator, and what the server would do", () => {
    const model = modelOf({ phase: "idle", can: ["training_prepare"] });
    expect([model.can("training_prepare"), model.can("training_begin")]).toEqual([true, false]);
    model.setRole(true, false);
    expect(model.can("training_prepare")).toBe(false);
    model.setRole(false, true);
    expect(model.can("training_prepare")).toBe(false);
  });
});

describe("the desk", () => {
  function desk(model: TrainingModel, answer: (name: string) => object = () => ({ phase: "ready" })): { desk: Desk; asked: [string, object][] } {
    const asked: [string, object][] = [];
    const choice = new Choice(model);
    choice.participant = "P01";
    const ask = (name: string, args: Record<string, unknown> = {}): Promise<never> => {
      asked.push([name, args]);
      return Promise.resolve({ done: true, result: answer(name) } as never);
    };
    return { desk: new Desk(model, choice, { ask }), asked };
  }

  it("prepares and begins with one press, and only begins what is ready", async () => {
    const model = modelOf();
    const { desk: one, asked } = desk(model);
    await one.start();
    expect(asked.map(([name]) => name)).toEqual(["training_prepare", "training_begin"]);
    model.takeState(state({ phase: "ready", run: run() }), 0);
    await one.start();
    expect(asked.at(-1)).toEqual(["training_begin", { run: "trial-1" }]);
    expect(asked).toHaveLength(3);
  });

  it("does not begin while a survey comes first, nor without a code, nor a mark without a reason", async () => {
    const model = modelOf();
    const { desk: one, asked } = desk(model, () => ({ phase: "idle", survey: "sus" }));
    expect(await one.start()).toBe(false);
    expect(asked).toHaveLength(1);
    expect(one.trouble).toContain("survey comes first");
    one.choice.participant = "anna";
    expect(await one.start()).toBe(false);
    expect(await one.mark("trial-1", "  ")).toBe(false);
    expect(asked).toHaveLength(1);
    expect(one.trouble).toContain("Say why");
  });

  it("goes on with what is paused", async () => {
    const model = modelOf({ phase: "paused", run: run() });
    const { desk: one, asked } = desk(model);
    await one.pause();
    model.takeState(state({ phase: "running", run: run() }), 0);
    await one.pause();
    expect(asked.map(([name]) => name)).toEqual(["training_resume", "training_pause"]);
  });
});

describe("a survey", () => {
  const items = [
    item("q1"), item("q2", { minimum: 0, maximum: 100, step: 5 }), item("why", { kind: "words" }), item("q3", { maximum: 4, minimum: 0, step: 1, labels: ["a", "b", "c", "d", "e"], optional: true }),
  ];

  it("has the values of its scale, and their names", () => {
    expect(valuesOf(items[0]!)).toEqual([1, 2, 3, 4, 5]);
    expect(valuesOf(items[1]!)).toHaveLength(21);
    expect(valuesOf(item("x", { minimum: 0, maximum: 1, step: 0.1 })).at(-1)).toBe(1);
    expect([labelOf(items[3]!, 2), labelOf(items[0]!, 2)]).toEqual(["c", "2"]);
  });

  it("is walked item by item, words left out, back and forth, from where it was left", () => {
    const walk = new SurveyWalk(survey(items, { q1: 4 }));
    expect([walk.progress, walk.item?.key, walk.words]).toEqual(["2 of 3", "q2", 1]);
    walk.skip();
    expect(walk.item?.key).toBe("q2");
    walk.answer(65);
    walk.back();
    expect(walk.answerOf(walk.item!)).toBe(65);
    walk.answer(70);
    walk.skip();
    expect([walk.item, walk.answers]).toEqual([null, { q1: 4, q2: 70 }]);
    expect(walk.finishes).toBe(false);
    expect(new SurveyWalk(survey(items, { why: "so" })).finishes).toBe(true);
  });

  it("misses what must be answered and is not", () => {
    expect(missing(survey(items), { q1: 1, why: "" })).toEqual(["q2", "why"]);
    expect(missing(survey(items), { q1: 1, q2: 0, why: "x" })).toEqual([]);
  });
});

describe("a run that is played", () => {
  it("goes straight between samples and shows nothing where nothing was seen", () => {
    const player = new RunPlayer(path());
    const out = new Float64Array(9);
    player.seek(0.525);
    expect([player.shapeAt(out), out[0], out[3]]).toEqual([3, expect.closeTo(55.25, 9), 25]);
    player.seek(1.1);
    expect([player.shapeAt(out), player.beamAt()]).toEqual([0, null]);
    player.seek(99);
    expect([player.timeS, player.shapeAt(out), player.ended, player.reachedBy()]).toEqual([2, 3, true, 2]);
    player.seek(0.7);
    expect(player.reachedBy()).toBe(1);
  });

  it("plays at its speed, stops at the end, and begins again", () => {
    const player = new RunPlayer(path());
    expect(player.step(0.1)).toBe(false);
    player.play();
    player.speed = 2;
    player.step(0.5);
    expect(player.timeS).toBeCloseTo(1);
    player.step(5);
    expect([player.timeS, player.playing]).toEqual([2, false]);
    player.play();
    expect([player.timeS, player.playing]).toEqual([0, true]);
  });

  it("has beads apart, at most so many, and colours from early to late", () => {
    const tips = path().tip;
    const shown = beads(tips, 0.9, 1000);
    expect(shown.every((at) => tips[at] !== null)).toBe(true);
    for (let i = 1; i < shown.length; i++) expect(tips[shown[i]!]![0] - tips[shown[i - 1]!]![0]).toBeGreaterThanOrEqual(0.9);
    expect(beads(tips, 0.1, 5).length).toBeLessThanOrEqual(5);
    const [early, late] = [[0, 0, 0], [0, 0, 0]];
    timeColour(early, 0, -1);
    timeColour(late, 0, 2);
    expect(early[2]! > early[0]! && late[0]! > late[2]!).toBe(true);
  });
});

describe("words and figures", () => {
  it("count time, targets and errors as people read them", () => {
    expect([timeLeft(119.2), timeLeft(59.1), timeLeft(0.2), timeLeft(-3), timeLeft(60)]).toEqual(["2:00", "1:00", "1 s", "0 s", "1:00"]);
    expect([tookWords(31.2), tookWords(59.4), tookWords(61.4), tookWords(119.8)]).toEqual(["31.2 s", "59.4 s", "1:01", "2:00"]);
    expect(countWords(figures())).toBe("1 of 2");
    expect(countWords(figures({ of: null, in_a_row: 1, wanted_in_a_row: 3 }))).toBe("1 of 3 in a row");
    expect(errorWords(target("a"), figures({ angle_deg: 30 }))).toBe("12 mm");
    expect(errorWords(target("a", { kind: "plane" }), figures({ distance_mm: 3.21, angle_deg: 30.4, up_deg: 8.6 }))).toBe("3.2 mm · 30° · beam 9°");
    expect(errorWords(target("a", { angle_deg: 15 }), figures({ distance_mm: null }))).toBe("– mm · –°");
    expect([valueWords(41.26, "s"), valueWords(812, "mm"), valueWords(-3.214, ""), valueWords(3, ""), valueWords(null, "s")]).toEqual(["41.3 s", "812 mm", "−3.21", "3", "–"]);
    expect(taskWords({ ...offer().tasks[0]!, name: "Practice", practice: true })).toBe("Practice");
  });

  it("say how a value stands", () => {
    expect(standingWords(line())).toBe("own best, before 60.0 s");
    expect(standingWords(line({ is_best: false, best_before: 30, percentile: 71.6, others: 9 }))).toBe("own best 30.0 s · better than 72 % of 9 others");
    expect(standingWords(line({ value: null, reason: "Not seen." }))).toBe("Not seen.");
    expect([trend(line()), trend(line({ better: "higher" })), trend(line({ better: "neither" })), trend(line({ history: [[1, 40]] }))]).toEqual(["better", "worse", null, null]);
    const chief = chiefLines([line({ key: "x" }), line({ key: "sparc" }), line({ key: "t" }), line({ key: "n", better: "neither" }), line({ key: "z", value: null })], 2);
    expect(chief.map(({ key }) => key)).toEqual(["t", "sparc"]);
  });

  it("draw a history with the best end up, within its place", () => {
    const falling = spark([[1, 60], [2, 50], [3, 40]], false, 92, 26);
    expect(falling.points[2]![1]).toBeLessThan(falling.points[0]![1]);
    expect(spark([[1, 60], [2, 40]], true, 92, 26).points[1]![1]).toBeGreaterThan(13);
    for (const [x, y] of falling.points) expect(x >= 0 && x <= 92 && y >= 0 && y <= 26).toBe(true);
    expect(spark([[1, 5]], true, 92, 26)).toMatchObject({ path: "", points: [[89, 13]] });
    expect(spark([], true, 92, 26).points).toEqual([]);
  });

  it("are a degree high on the trial's plate", () => {
    const degrees = (Math.atan((0.7 * TRIAL_EM.small) / 1000 / TRIAL_AHEAD_M) * 180) / Math.PI;
    expect(degrees).toBeGreaterThan(1);
  });

  it("believe of somebody's guide only a short text", () => {
    expect([guideStepOf({ guideStep: "3 of 9, Roll" }), guideStepOf({ guideStep: 3 }), guideStepOf({}), guideStepOf({ guideStep: "x".repeat(500) })]).toEqual(["3 of 9, Roll", "", "", ""]);
  });
});

describe("names in narrow places", () => {
  const widthOf = (words: string): number => words.length;

  it("are cut at a word, and never squeezed", () => {
    const name = "Aortic long axis, left ventricular outflow tract";
    expect(fitted(name, 60, widthOf)).toBe(name);
    expect(fitted(name, 20, widthOf)).toBe("Aortic long axis …");
    expect(fitted(name, 3, widthOf)).toBe("Aortic");
  });

  it("have a first part", () => {
    expect(shortName("Home view: tricuspid valve, right ventricle")).toBe("Home view");
    expect(shortName("Mitral valve")).toBe("Mitral valve");
  });
});
