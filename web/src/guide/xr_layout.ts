/** Where everything on the guide's plate is, mm from its upper left corner. No drawing. */

import type { Control } from "../link/steering";
import type { Rect } from "../xr/canvas_plate";
import { FONT } from "../xr/canvas_plate";

export const WIDTH = 460;
export const HEIGHT = 372;
const MARGIN = 20;
const ROW = 46;

export const BAR: Rect = { x: 0, y: 0, w: WIDTH, h: 42 };
export const CLOSE: Rect = { x: WIDTH - 46, y: 0, w: 46, h: 42 };
export const TITLE: Rect = { x: MARGIN, y: 50, w: WIDTH - 2 * MARGIN, h: 36 };
/** Six lines of 25. */
export const TEXT: Rect = { x: MARGIN, y: 88, w: WIDTH - 2 * MARGIN, h: 150 };
const STEER: Rect = { x: MARGIN, y: 222, w: WIDTH - 2 * MARGIN, h: ROW };
export const PROGRESS: Rect = { x: MARGIN, y: 274, w: 220, h: 34 };
export const FIGURE: Rect = { x: WIDTH - MARGIN - 190, y: PROGRESS.y, w: 190, h: PROGRESS.h };
const FOOT = HEIGHT - ROW - 12;
export const SKIP: Rect = { x: MARGIN, y: FOOT, w: 146, h: ROW };
export const NAVIGATION = {
  back: { x: WIDTH - MARGIN - 254, y: FOOT, w: 96, h: ROW },
  next: { x: WIDTH - MARGIN - 150, y: FOOT, w: 150, h: ROW },
} as const satisfies Record<string, Rect>;

export interface Spot {
  readonly label: string;
  readonly rect: Rect;
  /** What most people press. */
  readonly main?: boolean;
  /** Moves a control of the twin at a speed, in its unit a second, while it is held. */
  readonly control?: Control;
  readonly speed?: number;
}

const MOVES: Readonly<Record<"push" | "roll" | "flex", readonly (readonly [string, Control, number])[]>> = {
  push: [["Pull back", "insertion_mm", -18], ["Push in", "insertion_mm", 18]],
  roll: [["Roll left", "roll_deg", -70], ["Roll right", "roll_deg", 70]],
  flex: [["Forwards", "anterior_deg", 45], ["Backwards", "anterior_deg", -45], ["Left", "left_deg", 45], ["Right", "left_deg", -45]],
};

const STEERING = new Map(Object.entries(MOVES).map(([name, moves]) => [name, moves.map(([label, control, speed], index): Spot => {
  const w = (STEER.w - 8 * (moves.length - 1)) / moves.length;
  return { label, control, speed, rect: { x: STEER.x + index * (w + 8), y: STEER.y, w, h: STEER.h } };
})]));

/** Returns the buttons that steer the twin: the same objects each time. */
export function steerSpots(what: "push" | "roll" | "flex"): readonly Spot[] {
  return STEERING.get(what)!;
}

/** Returns a text in lines that are not wider than `width`. */
export function wrapped(context: Pick<CanvasRenderingContext2D, "font" | "measureText">, text: string, width: number, em: number): string[] {
  context.font = `450 ${em}px ${FONT}`;
  const lines: string[] = [];
  let line = "";
  for (const word of text.split(" ")) {
    const longer = line === "" ? word : `${line} ${word}`;
    if (line !== "" && context.measureText(longer).width > width) {
      lines.push(line);
      line = word;
    } else {
      line = longer;
    }
  }
  return line === "" ? lines : [...lines, line];
}
