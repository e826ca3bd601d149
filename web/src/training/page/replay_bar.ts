/** The bar below the picture while a run is shown again: play and pause, a slider over its time, and back to live. */

import { duration, fixed } from "../../maths/format";
import { byId, make, setText } from "../../ui/dom";
import type { Replay } from "../replay";
import { button } from "./parts";

const SPEEDS: readonly number[] = [1, 2, 4];

export class ReplayBar {
  private readonly bar = make("div", "training-replay");
  private readonly name = make("strong");
  private readonly play = button("Pause", () => this.replay.toggle());
  private readonly slider = make("input");
  private readonly time = make("output");
  private readonly reached = make("span", "faint");
  private readonly speed = button("1×", () => this.faster());
  private shownTime = "";

  /** nameOf: the name of a task, by its key. */
  constructor(private readonly replay: Replay, private readonly nameOf: (task: string) => string) {
    this.slider.type = "range";
    this.slider.min = "0";
    this.slider.step = "0.05";
    this.slider.id = "training-time";
    this.slider.setAttribute("aria-label", "Time in the run");
    this.slider.addEventListener("input", () => replay.seek(this.slider.valueAsNumber));
    this.time.htmlFor.add(this.slider.id);
    this.speed.setAttribute("aria-label", "Speed");
    this.bar.setAttribute("role", "group");
    this.bar.setAttribute("aria-label", "The run is shown again");
    this.bar.append(this.name, this.play, this.slider, this.time, this.reached, this.speed, button("Back to live", () => replay.stop(), "main"));
    byId("view").parentElement!.append(this.bar);
    this.show();
  }

  /** Called once for each frame; writes only what differs. */
  show(): void {
    const { player } = this.replay;
    const hidden = player === null;
    if (this.bar.hidden !== hidden) this.bar.hidden = hidden;
    if (player === null) return;
    const { path } = player;
    setText(this.play, player.playing ? "Pause" : "Play");
    const key = fixed(player.timeS, 1);
    if (key === this.shownTime && this.slider.max === String(player.durationS)) return;
    this.shownTime = key;
    setText(this.name, `${path.participant} · ${this.nameOf(path.task)}`);
    this.slider.max = String(player.durationS);
    if (document.activeElement !== this.slider || player.playing) this.slider.value = String(player.timeS);
    setText(this.time, `${duration(player.timeS)} of ${duration(player.durationS)}`);
    this.slider.setAttribute("aria-valuetext", this.time.textContent ?? "");
    setText(this.reached, `${player.reachedBy()} of ${path.targets.length} reached`);
  }

  private faster(): void {
    const { player } = this.replay;
    if (player === null) return;
    player.speed = SPEEDS[(SPEEDS.indexOf(player.speed) + 1) % SPEEDS.length]!;
    setText(this.speed, `${player.speed}×`);
  }
}
