/** The page's Training panel: choose, start, watch, judge; viewers see all of it without the buttons. */

import { byId, make, setText } from "../../ui/dom";
import type { Desk } from "../desk";
import type { TrainingModel } from "../model";
import { PAIR_ON_PAGE } from "../words";
import { Chooser } from "./chooser";
import type { Watching } from "./instructor_view";
import { InstructorView } from "./instructor_view";
import { say } from "./parts";
import { ResultView } from "./result_view";
import { SurveyDialog } from "./survey_dialog";
import { TrialView } from "./trial_view";
import { UnfinishedView } from "./unfinished_view";

const KEPT_AS = "cathxr.training.open";

export class TrainingPanel {
  private readonly panel = byId("training");
  private readonly toggle = byId<HTMLButtonElement>("training-toggle");
  private readonly body = byId("training-body");
  private readonly study = make("p", "training-study");
  private readonly viewing = make("p", "faint");
  private readonly sentence = make("p", "training-sentence");
  private readonly trouble = make("p", "trouble");
  private readonly chooser: Chooser;
  private readonly trial: TrialView;
  private readonly result: ResultView;
  private readonly unfinished: UnfinishedView;
  private readonly instructor: InstructorView;
  private readonly survey: SurveyDialog;
  private open: boolean;
  private wanted = false;

  constructor(
    private readonly model: TrainingModel, private readonly desk: Desk, watching: Watching, onShowRun: () => void,
    private readonly storage: Storage | null,
  ) {
    this.open = storage?.getItem(KEPT_AS) === "1";
    this.chooser = new Chooser(model, desk.choice, desk);
    this.trial = new TrialView(model, desk);
    this.result = new ResultView(model, desk, onShowRun);
    this.unfinished = new UnfinishedView(model, desk);
    this.instructor = new InstructorView(model, desk, watching);
    this.survey = new SurveyDialog(model, desk);
    this.trouble.setAttribute("role", "alert");
    this.body.append(
      this.study, this.viewing, this.survey.row, this.trial.element, this.result.element, this.trouble, this.sentence,
      this.chooser.element, this.unfinished.element, this.instructor.element,
    );
    this.toggle.addEventListener("click", () => this.setOpen(!this.open, true));
    model.listen(() => this.show());
    this.show();
  }

  /** Brings the figures up to date; called with every state. */
  showFigures(): void {
    this.trial.showFigures();
    this.instructor.show();
  }

  show(): void {
    const { model } = this;
    const held = document.activeElement;
    const { offer, state } = model;
    const asks = model.phase !== "idle" || model.survey !== null;
    if (asks && !this.wanted) this.setOpen(true, false);
    this.wanted = asks;
    say(this.study, offer === null ? "This server offers no training." : offer.study === null ? "" : `Study: ${offer.study}`);
    say(this.viewing, model.linked && offer !== null && !model.operating ? PAIR_ON_PAGE : "");
    say(this.sentence, state?.sentence ?? "");
    say(this.trouble, this.desk.trouble);
    this.trial.show();
    this.result.show();
    this.chooser.element.hidden = offer === null || !model.operating || model.atHand;
    this.chooser.show();
    this.unfinished.show();
    this.instructor.element.hidden = offer === null || !model.operating;
    this.instructor.show();
    this.survey.update();
    this.keepFocus(held);
    this.fold();
  }

  private setOpen(open: boolean, byPerson: boolean): void {
    this.open = open;
    if (byPerson) {
      try {
        this.storage?.setItem(KEPT_AS, open ? "1" : "0");
      } catch {
        // a full or forbidden storage: it holds for this visit
      }
    }
    this.fold();
  }

  private fold(): void {
    this.panel.dataset["open"] = String(this.open);
    this.toggle.setAttribute("aria-expanded", String(this.open));
    const { phase } = this.model;
    setText(byId("training-phase"), phase === "idle" ? "" : phase);
  }

  /** Who pressed a button that is gone goes on with the next one that is there, not at the top of the page. */
  private keepFocus(held: Element | null): void {
    if (!(held instanceof HTMLElement) || !this.body.contains(held) || held.offsetParent !== null) return;
    const next = [this.trial.element, this.result.element, this.chooser.element]
      .flatMap((part) => [...part.querySelectorAll<HTMLButtonElement>("button")])
      .find((each) => each.offsetParent !== null && !each.disabled);
    (next ?? this.toggle).focus();
  }
}
