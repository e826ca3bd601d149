/** The list of steps on the page: it follows the states without being built anew. */

import { keyed } from "../calibrate/keyed";
import { withUnits } from "../maths/format";
import { make, setText } from "../ui/dom";
import type { SetupCheckState } from "../generated/messages";
import type { Step, Verdict } from "./steps";
import { ageWords } from "./steps";

const SIGNS: Record<Verdict, string> = { good: "✓", warn: "!", wrong: "✕", unknown: "?" };
const WORDS: Record<Verdict, string> = { good: "good", warn: "look at this", wrong: "wrong", unknown: "not known yet" };

/** Shows steps in a list. `ask`: what a person is asked, which belongs to the step `which`. */
export function showSteps(host: HTMLElement, steps: readonly Step[], nowS: number, ask: HTMLElement): void {
  keyed(host, steps, (step) => step.subject, makeStep, (element, step) => {
    element.dataset["verdict"] = step.verdict;
    const sign = element.querySelector(".sign")!;
    setText(sign, SIGNS[step.verdict]);
    sign.setAttribute("aria-label", WORDS[step.verdict]);
    setText(element.querySelector("h2")!, step.title);
    const list = element.querySelector("ul")!;
    list.dataset["single"] = String(step.checks.length === 1);
    keyed(list, step.checks, (check) => check.title, makeCheck, (item, check) => fill(item, check, nowS, saysMore(step.checks, check)));
    if (step.subject !== "which") return;
    ask.hidden = step.verdict === "good";
    if (ask.parentElement !== element) element.append(ask);
  });
}

/** Returns whether what to do is not the same as that of the next check, which then says it for both. */
function saysMore(checks: readonly SetupCheckState[], check: SetupCheckState): boolean {
  const next = checks[checks.indexOf(check) + 1];
  return check.then !== "" && check.then !== next?.then;
}

function makeStep(): HTMLElement {
  const element = make("li", "step");
  const sign = make("span", "sign");
  sign.setAttribute("role", "img");
  element.append(sign, make("h2"), make("ul"));
  return element;
}

/** Returns a phrase as a sentence; a command at its beginning stays as it is typed. */
function asSentence(phrase: string): string {
  if (phrase === "") return "";
  const begun = phrase.startsWith("cathxr ") ? phrase : phrase[0]!.toUpperCase() + phrase.slice(1);
  return /[.?]$/.test(begun) ? begun : `${begun}.`;
}

function makeCheck(): HTMLElement {
  const item = make("li", "check");
  item.append(make("span", "what"), make("span", "found"), make("span", "age faint"), make("p", "then"));
  return item;
}

function fill(item: HTMLElement, check: SetupCheckState, nowS: number, saysMore: boolean): void {
  item.dataset["verdict"] = check.verdict;
  setText(item.querySelector(".what")!, check.title);
  setText(item.querySelector(".found")!, withUnits(check.found));
  setText(item.querySelector(".age")!, ageWords(check, nowS));
  const then = item.querySelector<HTMLElement>(".then")!;
  then.hidden = !saysMore;
  setText(then, asSentence(check.then));
}
