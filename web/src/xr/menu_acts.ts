/** What a press on the menu in the scene does, besides changing a setting. */

import { Vector3 } from "three";
import type { Stage } from "../stage/stage";
import type { TrainingAct } from "../training/xr/rows";
import type { RollView } from "../ui/roll";
import type { Act, Row, Situation, TargetAct } from "./menu_model";
import { nextArm } from "./menu_model";
import type { Placement } from "./placement";

export class MenuActs {
  /** The heart's parts, by the settings' name and by the one that people read. */
  parts: Situation["parts"] = [];
  /** Shows a newcomer round; null where nobody does. */
  guide: (() => void) | null = null;
  /** What the menu offers about trials, and what a press there does. */
  training: { rows(): Row[]; act(what: TrainingAct): void } | null = null;
  /** How far the roll can be trusted, and what puts it right. */
  roll: { readonly view: RollView | null; act(): void } | null = null;
  private readonly place = new Vector3();

  constructor(private readonly stage: Stage, private readonly go: (placement: Placement) => void, private readonly leave: () => void) {}

  act(act: Act): void {
    if ("place" in act) this.go(act.place);
    if ("leave" in act) this.leave();
    if ("guide" in act) this.guide?.();
    if ("target" in act) this.actOnTarget(act.target);
    if ("arm" in act) this.turnArm(act.arm, act.by);
    if ("parts" in act) this.showParts(act.parts === "show");
    if ("roll" in act) this.roll?.act();
    if ("training" in act) this.training?.act(act.training);
  }

  /** The target in force, and how many there are. */
  get target(): Situation["target"] {
    const { active, targets } = this.stage.targets;
    if (active === null) return null;
    return { name: active.name, own: active.own, number: targets.indexOf(active) + 1, count: targets.length };
  }

  private actOnTarget(what: TargetAct): void {
    const { targets, tip } = this.stage;
    if (what === "next") targets.step(1);
    else if (what === "previous") targets.step(-1);
    else if (what === "add" && tip.valid) targets.add(this.place.setFromMatrixPosition(tip.matrix));
    else if (what === "remove" && targets.active?.own === true) targets.remove(targets.active.id);
  }

  private turnArm(arm: 0 | 1, by: number): void {
    const { store } = this.stage;
    const turned = nextArm(store.value.arms[arm], by);
    store.set({ arms: arm === 0 ? [turned, store.value.arms[1]] : [store.value.arms[0], turned] });
  }

  private showParts(visible: boolean): void {
    const { store } = this.stage;
    store.set({ parts: Object.fromEntries(this.parts.map(({ name }) => [name, { ...store.part(name), visible }])) });
  }
}
