/** What the buttons do, written beside controllers and hands while the guide or the help is shown. */

import type { View } from "../scene/view";
import { Quaternion, Vector3 } from "three";
import type { Frame } from "../stage/feature";
import { box, CanvasPlate, INK, write } from "../xr/canvas_plate";
import type { Immersion } from "../xr/immersion";
import { facing } from "../xr/interaction";
import type { Pointer } from "../xr/pointer";
import { BUTTON_NAMES, CONTROLLER_PARTS, HAND_PARTS } from "./words";

const WIDTH = 168;
const ROW = 21;
const MOST_ROWS = 5;
const EM = 14;
/** Outwards from the hand, and above it, m. */
const OUT_M = 0.14;
const UP_M = 0.05;
const work = { turn: new Quaternion(), side: new Vector3() };

class HandLabel extends CanvasPlate {
  private rows: readonly (readonly [string, string])[] = [];
  private kind = "";

  constructor() {
    super("hand label", WIDTH, MOST_ROWS * ROW + 10, 3);
  }

  say(kind: string, rows: readonly (readonly [string, string])[]): void {
    if (kind === this.kind) return;
    this.kind = kind;
    this.rows = rows;
    this.redraw();
  }

  protected paint(context: CanvasRenderingContext2D): void {
    box(context, { x: 0, y: 0, w: WIDTH, h: this.rows.length * ROW + 10 }, 8, "rgba(16, 23, 33, 0.86)");
    this.rows.forEach(([part, does], index) => {
      const y = 5 + index * ROW;
      write(context, part, { x: 8, y, w: 82, h: ROW }, EM, INK.soft, "left", 500);
      write(context, does, { x: 94, y, w: WIDTH - 102, h: ROW }, EM, INK.text, "left", 650);
    });
  }
}

export class HandLabels {
  private readonly labels = [new HandLabel(), new HandLabel()] as const;

  constructor(private readonly immersion: Immersion, private readonly view: View) {
    for (const label of this.labels) view.scene.add(label.group);
  }

  /** guiding: whether the guide runs. */
  update(frame: Frame, guiding: boolean): void {
    const { menu, pointers } = this.immersion;
    const wanted = frame.immersive && (guiding || (menu.visible && menu.openTab === "Help"));
    for (let hand = 0; hand < 2; hand++) this.place(this.labels[hand]!, pointers[hand]!, wanted);
  }

  private place(label: HandLabel, pointer: Pointer, wanted: boolean): void {
    label.group.visible = wanted && pointer.tracked && !pointer.selecting && !pointer.squeezing;
    if (!label.group.visible) return;
    const side = pointer.left ? "left" : "right";
    if (pointer.bare) label.say(`hand ${side}`, side === "left" ? LEFT_HAND : HAND_PARTS);
    else label.say(`controller ${side}`, PARTS[side]);
    const { head } = this.view;
    work.side.set(pointer.left ? -OUT_M : OUT_M, UP_M, 0).applyQuaternion(head.orientation);
    label.group.position.copy(pointer.position).add(work.side);
    label.group.quaternion.copy(facing(work.turn, label.group.position, head.position));
    label.group.updateMatrixWorld(true);
  }
}

const PARTS = {
  left: [...CONTROLLER_PARTS, [BUTTON_NAMES.left.menu, "menu"], [BUTTON_NAMES.left.help, "help"]],
  right: [...CONTROLLER_PARTS, [BUTTON_NAMES.right.menu, "menu"], [BUTTON_NAMES.right.help, "help"]],
} as const satisfies Record<"left" | "right", readonly (readonly [string, string])[]>;
const LEFT_HAND: readonly (readonly [string, string])[] = [...HAND_PARTS, ["Palm to face", "menu"]];
