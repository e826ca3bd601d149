/** What only an operator may do, and how a viewer becomes one: pairing, recording, resetting the tracker. */

import type { Hello, SceneDescription, SessionMessage } from "../generated/messages";
import type { Commands } from "../link/commands";
import { duration } from "../maths/format";
import { byId, setText } from "./dom";
import { wirePairing } from "./pairing";
import { toast } from "./toasts";

export class Operator {
  role: "viewer" | "operator" = "viewer";
  private needsPairing = false;
  private linked = false;
  private recording = false;
  private hasTwin = false;
  private readonly record = byId<HTMLButtonElement>("record");
  private readonly reset = byId<HTMLButtonElement>("reset-tracker");

  /** `onRole` hears whether this page may steer now, and whether it may command at all. */
  constructor(
    private readonly commands: Commands,
    private readonly onRole: (steering: boolean, operating: boolean) => void,
  ) {
    this.record.addEventListener("click", () => this.toggleRecording());
    this.reset.addEventListener("click", () => void this.ask("reset_tracker", "The tracker starts afresh."));
    wirePairing(commands, () => {
      this.role = "operator";
      toast("Paired: this page may steer and record.");
      this.refresh();
    });
    this.refresh();
  }

  /** Whether this page may command now. */
  get operating(): boolean {
    return this.linked && this.role === "operator";
  }

  greet(hello: Hello): void {
    this.linked = true;
    this.role = hello.role;
    this.needsPairing = hello.needs_pairing;
    setText(byId("no-steering-text"), `There is nothing to steer: ${hello.source === "replay" ? "this is a recording" : "the catheter is moved by hand"}.`);
    this.refresh();
  }

  /** The link is gone: nothing can be asked. */
  leave(): void {
    this.linked = false;
    this.showSession({ type: "session", recording: false, name: null, seconds: 0 });
    this.refresh();
  }

  describe(scene: SceneDescription): void {
    this.hasTwin = scene.twin !== null;
    this.refresh();
  }

  showSession(session: SessionMessage): void {
    this.recording = session.recording;
    this.record.setAttribute("aria-pressed", String(session.recording));
    setText(byId("record-text"), session.recording ? `Stop ${duration(session.seconds)}` : "Record");
    this.record.title = session.recording ? `Recording to ${session.name ?? "disk"} (Space stops)` : "Record to disk (Space)";
  }

  toggleRecording(): void {
    if (this.record.disabled || this.record.hidden) return;
    if (this.recording) void this.ask("record_stop", "The recording is saved.");
    else void this.ask("record_start", "Recording.");
  }

  private async ask(name: string, done: string): Promise<void> {
    const answer = await this.commands.ask(name);
    toast(answer.done ? done : answer.sentence, answer.done ? "good" : "bad");
  }

  private refresh(): void {
    const { operating } = this;
    const viewing = this.linked && this.role === "viewer";
    this.record.disabled = this.reset.disabled = !operating;
    this.record.hidden = this.reset.hidden = viewing;
    byId("pairing").hidden = !(viewing && this.needsPairing);
    byId("steering").hidden = !(this.hasTwin && !viewing);
    byId("no-steering").hidden = !(this.linked && !this.hasTwin && operating);
    byId("role").hidden = !viewing;
    setText(byId("role"), "viewing only");
    for (const control of byId("steering").querySelectorAll<HTMLInputElement | HTMLSelectElement>("input, select")) {
      control.disabled = !operating;
    }
    this.onRole(operating && this.hasTwin, operating);
  }
}
