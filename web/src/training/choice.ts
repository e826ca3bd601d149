/** What is chosen for the next trial: whose it is, which task, which view. The same for the page and the headset. */

import type { TrainingOffer, TrainingParticipant, TrainingTask } from "../generated/messages";
import { asCode, codeTrouble } from "./code";
import type { TrainingModel, View } from "./model";

export const VIEWS: readonly { readonly value: View; readonly label: string }[] = [
  { value: "3d", label: "3D" }, { value: "2d", label: "2D" }, { value: "free", label: "free" },
];

export class Choice {
  private code = "";
  private taskKey = "";
  private viewChosen: View | null = null;

  constructor(private readonly model: TrainingModel) {}

  private get offer(): TrainingOffer | null {
    return this.model.offer;
  }

  /** Whether a study says what comes next. */
  get inStudy(): boolean {
    return this.offer !== null && this.offer.study !== null;
  }

  /** The code that is chosen or typed; without a choice, the first of a study that has something to do. */
  get participant(): string {
    if (this.code !== "" || !this.inStudy) return this.code;
    const { participants } = this.offer!;
    return (participants.find(({ done }) => !done) ?? participants[0])?.code ?? "";
  }

  set participant(typed: string) {
    this.code = asCode(typed);
    this.model.change();
  }

  /** Who that is, where they are enrolled. */
  get enrolled(): TrainingParticipant | null {
    return this.offer?.participants.find(({ code }) => code === this.participant) ?? null;
  }

  get task(): TrainingTask | null {
    const tasks = this.offer?.tasks ?? [];
    return tasks.find(({ key }) => key === this.taskKey) ?? tasks.find(({ problem }) => problem === "") ?? tasks[0] ?? null;
  }

  chooseTask(key: string): void {
    if (key === this.taskKey) return;
    this.taskKey = key;
    this.viewChosen = null; // the new task's own
    this.model.change();
  }

  /** The view that is chosen; without a choice, the task's own. */
  get view(): View {
    return this.viewChosen ?? this.task?.view ?? "free";
  }

  set view(view: View) {
    this.viewChosen = view;
    this.model.change();
  }

  /** Goes on to the next enrolled participant, or by -1 to the one before, round and round. */
  stepParticipant(by: number): void {
    const codes = (this.offer?.participants ?? []).map(({ code }) => code);
    if (codes.length === 0) return;
    const at = codes.indexOf(this.participant);
    this.participant = codes[at < 0 ? (by > 0 ? 0 : codes.length - 1) : (at + by + codes.length) % codes.length]!;
  }

  stepTask(by: number): void {
    const tasks = this.offer?.tasks ?? [];
    if (tasks.length === 0) return;
    const at = tasks.findIndex(({ key }) => key === this.task?.key);
    this.chooseTask(tasks[(at + by + tasks.length) % tasks.length]!.key);
  }

  /** Why this cannot be started, as a sentence; empty when it can. */
  get trouble(): string {
    if (this.offer === null) return "The server has not said what can be trained.";
    if (this.inStudy) {
      if (this.enrolled === null) {
        return this.participant === "" ? "Nobody is enrolled in this study yet." : `${this.participant} is not enrolled in this study.`;
      }
      return this.enrolled.done ? `The study has nothing more for ${this.participant}.` : "";
    }
    const wrong = codeTrouble(this.participant);
    if (wrong !== "") return wrong;
    if (this.task === null) return "There is no task for this heart.";
    return this.task.problem;
  }

  /** What `training_prepare` is asked with. */
  args(): Record<string, unknown> {
    if (this.inStudy) return { participant: this.participant };
    return { participant: this.participant, task: this.task?.key ?? "", view: this.view };
  }
}
