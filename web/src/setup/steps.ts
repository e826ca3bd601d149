/** The walk through the set-up as steps: what each is called, and how all of its checks stand together. */

import type { SetupCheckState } from "../generated/messages";

export type Verdict = SetupCheckState["verdict"];
export type Subject = SetupCheckState["subject"];

/** In the order in which a new owner goes through them. */
export const TITLES: readonly (readonly [Subject, string])[] = [
  ["cameras", "Both cameras send pictures"],
  ["which", "Which camera is which"],
  ["light", "Exposure and back light"],
  ["focus", "Focus"],
  ["markers", "Fiducials on the crosses"],
  ["encoder", "The encoder turns"],
  ["network", "Network and certificate"],
  ["headset", "A headset is connected"],
  ["rig", "The rig was measured"],
];

const GRAVITY: Record<Verdict, number> = { good: 0, unknown: 1, warn: 2, wrong: 3 };

export interface Step {
  readonly subject: Subject;
  readonly title: string;
  readonly verdict: Verdict;
  readonly checks: readonly SetupCheckState[];
}

/** Returns the steps that have checks; each is as its gravest check. */
export function stepsOf(checks: readonly SetupCheckState[]): Step[] {
  return TITLES.flatMap(([subject, title]) => {
    const own = checks.filter((each) => each.subject === subject);
    if (own.length === 0) return [];
    const verdict = own.reduce<Verdict>((worst, each) => (GRAVITY[each.verdict] > GRAVITY[worst] ? each.verdict : worst), "good");
    return [{ subject, title, verdict, checks: own }];
  });
}

/** Returns what the whole comes to, in a sentence. */
export function summary(steps: readonly Step[]): string {
  const count = (verdict: Verdict): number => steps.filter((each) => each.verdict === verdict).length;
  const [wrong, warn, unknown] = [count("wrong"), count("warn"), count("unknown")];
  if (wrong + warn + unknown === 0) return "All is well.";
  const first = steps.find((each) => each.verdict === "wrong") ?? steps.find((each) => each.verdict !== "good");
  const parts = [
    wrong > 0 ? `${wrong} wrong` : "", warn > 0 ? `${warn} to look at` : "", unknown > 0 ? `${unknown} not known yet` : "",
  ].filter((each) => each !== "");
  return `${parts.join(", ")}. Next: ${first!.title.toLowerCase()}.`;
}

/** Returns how long ago a check was measured, in words; empty: it is of now. */
export function ageWords(check: SetupCheckState, nowS: number): string {
  if (check.t === null) return "";
  const age = Math.max(0, nowS - check.t);
  if (age < 10) return "measured just now";
  return age < 100 ? `measured ${Math.round(age / 10) * 10} s ago` : `measured ${Math.round(age / 60)} min ago`;
}
