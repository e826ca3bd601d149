/** Everything that a person can do about training, from the page or the headset: asks the server and keeps what it said. */

import type { Answer, Commands } from "../link/commands";
import type { Choice } from "./choice";
import type { TrainingCommand, TrainingModel } from "./model";
import type { Answers } from "./survey";

const SURVEY_FIRST = "A survey comes first: answer it, then start.";

export class Desk {
  /** Why the last wish was refused, as a sentence; empty when it was granted. */
  trouble = "";
  /** Whether an answer is waited for: a second press does nothing. */
  busy = false;
  /** What was wrong with the choice when it was refused here. */
  private unchosen = "";

  constructor(private readonly model: TrainingModel, readonly choice: Choice, private readonly commands: Pick<Commands, "ask">) {
    let phase = model.phase;
    model.listen(() => {
      const past = phase !== model.phase || (this.unchosen !== "" && choice.trouble !== this.unchosen);
      if (past) this.trouble = this.unchosen = ""; // what was refused is no longer what is wished for
      phase = model.phase;
    });
  }

  /** Makes the chosen trial ready: its targets are shown, its view is held. */
  async prepare(): Promise<boolean> {
    const { trouble } = this.choice;
    if (trouble !== "") {
      this.unchosen = trouble;
      return this.refuse(trouble);
    }
    const answer = await this.ask("training_prepare", this.choice.args());
    if (answer.done && answer.result["phase"] !== undefined && answer.result["phase"] !== "ready") return this.refuse(SURVEY_FIRST);
    return answer.done;
  }

  /** Starts the trial that is ready, or the chosen one. */
  async start(): Promise<boolean> {
    if (this.model.phase === "ready") return this.act("training_begin");
    if (!(await this.prepare())) return false;
    return (await this.ask("training_begin")).done; // what is ready now may not have been told yet
  }

  /** Pauses, or goes on. */
  pause(): Promise<boolean> {
    return this.act(this.model.phase === "paused" ? "training_resume" : "training_pause");
  }

  abort(): Promise<boolean> {
    return this.act("training_abort");
  }

  /** The same once more: it is ready then. */
  repeat(): Promise<boolean> {
    return this.act("training_repeat");
  }

  close(): Promise<boolean> {
    return this.act("training_close");
  }

  /** Says that a trial must not count, and why. */
  async mark(trial: string, reason: string): Promise<boolean> {
    if (reason.trim() === "") return this.refuse("Say why it must not count: the reason is kept with the trial.");
    return (await this.ask("training_mark", { trial, reason: reason.trim() })).done;
  }

  async goOn(trial: string): Promise<boolean> {
    return (await this.ask("training_continue", { trial })).done;
  }

  /** Tries again to store what could not be stored. */
  async store(): Promise<boolean> {
    return (await this.ask("training_store")).done;
  }

  /** Hands in answers; done: the survey is through. */
  async answer(survey: string, occasion: string, answers: Answers, done: boolean): Promise<boolean> {
    return (await this.ask("survey_answer", { survey, occasion, answers, done }, !done)).done;
  }

  /** Asks for something about the trial at hand: refused where another operator has another one there by now. */
  private async act(name: TrainingCommand): Promise<boolean> {
    const { run } = this.model;
    return (await this.ask(name, run === null ? {} : { run: run.id })).done;
  }

  /** quietly: beside others, without their waiting for it. */
  private async ask(name: TrainingCommand, args: Record<string, unknown> = {}, quietly = false): Promise<Answer> {
    if (this.busy && !quietly) return { done: false, sentence: "" };
    if (!quietly) this.busy = true;
    const answer = await this.commands.ask(name, args);
    if (!quietly) this.busy = false;
    this.trouble = answer.done ? "" : answer.sentence;
    this.model.change();
    return answer;
  }

  private refuse(sentence: string): false {
    this.trouble = sentence;
    this.model.change();
    return false;
  }
}
