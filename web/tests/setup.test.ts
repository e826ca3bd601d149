import { describe, expect, it } from "vitest";
import type { SetupCheckState } from "../src/generated/messages";
import { ageWords, stepsOf, summary, TITLES } from "../src/setup/steps";

function check(subject: SetupCheckState["subject"], verdict: SetupCheckState["verdict"], t: number | null = null): SetupCheckState {
  return { subject, title: `${subject} ${verdict}`, verdict, found: "", then: "", camera: "", t };
}

describe("steps of the set-up", () => {
  it("are in the order of the walk, each as its gravest check", () => {
    const steps = stepsOf([check("light", "good"), check("cameras", "warn"), check("light", "wrong"), check("light", "unknown")]);
    expect(steps.map((each) => [each.subject, each.verdict])).toEqual([["cameras", "warn"], ["light", "wrong"]]);
  });

  it("come to a sentence that names what to do next", () => {
    expect(summary(stepsOf([check("focus", "good")]))).toBe("All is well.");
    const open = stepsOf([check("cameras", "unknown"), check("focus", "wrong"), check("network", "warn")]);
    expect(summary(open)).toBe("1 wrong, 1 to look at, 1 not known yet. Next: focus.");
  });

  it("know every subject once", () => {
    expect(new Set(TITLES.map(([subject]) => subject)).size).toBe(TITLES.length);
  });

  it("say how old a measurement is", () => {
    expect(ageWords(check("focus", "good"), 100)).toBe("");
    expect(ageWords(check("focus", "good", 99), 100)).toBe("measured just now");
    expect(ageWords(check("focus", "good", 58), 100)).toBe("measured 40 s ago");
    expect(ageWords(check("focus", "good", 100), 400)).toBe("measured 5 min ago");
  });
});
