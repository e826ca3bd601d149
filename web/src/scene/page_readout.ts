/** The figures over the page's 3D view: how late the drawing is, the target in force, and the wall. */

import { Vector3 } from "three";
import { fixed } from "../maths/format";
import type { ReachBy } from "../maths/target";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import type { TargetReadout } from "./target_readout";
import { make, setText } from "../ui/dom";

const EVERY_MS = 120;
/** Less than this deep is within what labels and placement can tell. */
const TOLD_MM = 0.2;

export class PageReadout implements Feature {
  private readonly panel = make("div", "readout");
  private readonly delay = make("p", "faint");
  private readonly wall = make("p", "in-wall");
  private readonly targetRow = make("div", "target");
  private readonly name = make("strong");
  private readonly byTip = make("span", "far");
  private readonly byBeam = make("span", "far");
  private readonly progress = make("progress");
  private readonly remove = button("Remove", "Take this target away", () => this.removeActive());
  private shownMs = -Infinity;

  constructor(private readonly stage: Stage) {
    const { targets } = stage;
    this.progress.max = 1;
    this.progress.setAttribute("aria-label", "How long the target has been kept");
    const row = make("div", "buttons");
    row.append(
      button("‹", "The target before", () => targets.step(-1)),
      button("›", "The next target", () => targets.step(1)),
      button("Add at tip", "Place a target where the tip is; a double click on the heart places one there", () => this.addAtTip()),
      this.remove,
    );
    this.byTip.title = "From the tip to the target, and between where it looks and the way there";
    this.byBeam.title = "From the beam's middle line to the target, and between the beam and the way there";
    this.targetRow.append(this.name, this.byTip, this.byBeam, this.progress, row);
    this.panel.append(this.delay, this.wall, this.targetRow);
    this.panel.hidden = true;
    stage.view.renderer.domElement.parentElement?.append(this.panel);
    stage.store.listen(() => (this.shownMs = -Infinity));
    targets.listen(() => (this.shownMs = -Infinity));
  }

  update(frame: Frame): boolean {
    if (frame.nowMs - this.shownMs < EVERY_MS) return false;
    this.shownMs = frame.nowMs;
    const { store, readout } = this.stage;
    const { hud, mode } = store.value;
    this.panel.hidden = !hud || mode !== "3d" || frame.immersive;
    if (this.panel.hidden) return false;
    this.showDelay(frame);
    const { wall } = readout;
    this.wall.hidden = wall.depthMm < TOLD_MM;
    if (!this.wall.hidden) setText(this.wall, `In the wall, ${fixed(wall.depthMm, 1)} mm deep`);
    this.showTarget();
    return false;
  }

  dispose(): void {
    this.panel.remove();
  }

  private showDelay({ track }: Frame): void {
    this.delay.hidden = track === null;
    if (track === null) return;
    if (track.stale) setText(this.delay, "No new positions: the last one is shown");
    else if (track.delayMs === null) setText(this.delay, "A recording");
    else setText(this.delay, `Drawn ${fixed(track.delayMs, 0)} ms behind${track.extrapolated ? ", carried on" : ""}`);
  }

  private showTarget(): void {
    const { store, targets, readout } = this.stage;
    const { active } = targets;
    this.targetRow.hidden = !store.value.targets || this.stage.training.atHand || this.stage.replay.shown;
    if (this.targetRow.hidden) return;
    const { target } = readout;
    setText(this.name, active === null ? "No target yet" : active.name);
    this.remove.hidden = active === null || !active.own;
    this.targetRow.dataset["state"] = target?.reached ? "reached" : target?.within ? "within" : "away";
    this.progress.hidden = target === null || !target.within || target.reached;
    this.progress.value = target?.dwelt ?? 0;
    this.byBeam.hidden = target === null;
    if (target === null) {
      setText(this.byTip, active === null ? "" : "the tip is not known");
      delete this.byTip.dataset["counts"];
      return;
    }
    showPair(this.byTip, "tip", target.distanceMm, target.angleDeg, target);
    showPair(this.byBeam, "beam", target.beamDistanceMm, target.beamAngleDeg, target);
  }

  private addAtTip(): void {
    const { tip, targets } = this.stage;
    if (tip.valid) targets.add(new Vector3().setFromMatrixPosition(tip.matrix));
  }

  private removeActive(): void {
    const { targets } = this.stage;
    if (targets.active !== null) targets.remove(targets.active.id);
  }
}

/** Writes how far the tip or the beam is from a target; what counts stands out, and says what is good enough already. */
function showPair(at: HTMLElement, by: ReachBy, mm: number | null, deg: number | null, target: TargetReadout): void {
  const counts = target.by === by;
  if (counts) at.dataset["counts"] = "";
  else delete at.dataset["counts"];
  if (mm === null || deg === null) {
    setText(at, `${by}: direction unknown`);
    return;
  }
  const good = (enough: boolean): string => (counts && enough ? " ✓" : "");
  setText(at, `${by} ${fixed(mm, 1)} mm${good(target.near)}, ${fixed(deg, 0)}°${good(target.aligned)}${counts && target.reached ? " – reached" : ""}`);
}

function button(label: string, title: string, act: () => void): HTMLButtonElement {
  const made = make("button", "", label);
  made.type = "button";
  made.title = title;
  made.addEventListener("click", act);
  return made;
}
