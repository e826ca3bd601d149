/** What an instructor looks at: who wears the headset, what is seen, how the trial goes, and marking it invalid. */

import type { People } from "../../follow/people";
import { make, setText } from "../../ui/dom";
import type { Desk } from "../desk";
import type { TrainingModel } from "../model";
import { countWords, PHASE_WORDS, timeLeft, VIEW_WORDS } from "../words";
import { markForm } from "./mark_form";
import { button } from "./parts";

/** What of the link and the scene an instructor is told. */
export interface Watching {
  readonly people: People;
  /** The status at the top of the page: "tracked", … */
  status(): string;
  /** The guide's step of who is followed; empty while there is none. */
  guideStep(): string;
}

export class InstructorView {
  readonly element = make("details", "training-instructor");
  private readonly wearer = make("dd");
  private readonly seen = make("dd");
  private readonly trial = make("dd");
  private readonly tip = make("dd");
  private readonly follow = button("See it", () => this.toggleFollow());
  private readonly mark = make("div");
  private marked = "";

  constructor(private readonly model: TrainingModel, private readonly desk: Desk, private readonly watching: Watching) {
    const rows = make("dl", "pairs");
    const pairs: readonly (readonly [string, HTMLElement])[] = [
      ["Headset", this.wearer], ["Sees", this.seen], ["Trial", this.trial], ["Tip", this.tip],
    ];
    for (const [term, value] of pairs) {
      const row = make("div");
      row.append(make("dt", "", term), value);
      rows.append(row);
    }
    this.element.append(make("summary", "", "Instructor"), rows, this.follow, this.mark);
    this.element.addEventListener("toggle", () => this.show());
  }

  show(): void {
    if (!this.element.open) return;
    const { model, watching } = this;
    const { run, now, phase } = model;
    const wearer = this.wearerNow();
    setText(this.wearer, wearer === null ? "nobody wears one" : `${wearer.name}, ${wearer.role === "operator" ? "may start trials" : "viewing only"}`);
    const view = run === null || !model.atHand ? "what they choose" : `${VIEW_WORDS[run.view]}${run.view === "free" ? "" : ", held by the trial"}`;
    const guide = watching.guideStep();
    setText(this.seen, guide === "" ? view : `${view}; guide: ${guide}`);
    const progress = now === null || !model.underWay ? "" : `, ${countWords(now)}, ${timeLeft(now.remaining_s)} left`;
    setText(this.trial, `${PHASE_WORDS[phase]}${progress}`);
    setText(this.tip, now !== null && phase === "running" && now.hindrance !== "" ? now.hindrance : watching.status());
    this.follow.hidden = wearer === null || watching.people.self?.id === wearer.id;
    const followed = wearer !== null && watching.people.followed?.id === wearer.id;
    setText(this.follow, followed ? "Stop seeing what they see" : "See what they see");
    this.follow.setAttribute("aria-pressed", String(followed));
    this.showMark();
  }

  /** The marking's form belongs to one trial: another trial has a new one. */
  private showMark(): void {
    const { model } = this;
    const { run } = model;
    const able = run !== null && model.can("training_mark");
    const id = able ? run.id : "";
    if (id === this.marked) return;
    this.marked = id;
    if (run === null || !able) this.mark.replaceChildren();
    else this.mark.replaceChildren(markForm("this trial", "mark-run", (reason) => this.desk.mark(run.id, reason)));
    this.mark.hidden = !able;
  }

  private wearerNow(): People["self"] {
    const { people } = this.watching;
    return people.others.find(({ kind }) => kind === "headset") ?? (people.self?.kind === "headset" ? people.self : null);
  }

  private toggleFollow(): void {
    const { people } = this.watching;
    const wearer = this.wearerNow();
    if (wearer === null) return;
    if (people.followed?.id === wearer.id) people.stop();
    else people.follow(wearer.id);
  }
}
