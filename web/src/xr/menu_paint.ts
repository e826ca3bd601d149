/** Draws the menu, mm by mm. */

import type { Rect } from "./canvas_plate";
import { box, INK, write } from "./canvas_plate";
import {
  CLOSE, controlRect, EM, FOOTER, HEIGHT, labelRect, numberRect, partNumberRect, rowRect, segments, switchRect, tabRects, TITLE_BAR, trackRect, WIDTH,
} from "./menu_layout";
import type { Row, Tab } from "./menu_model";

export interface MenuPicture {
  readonly tab: Tab;
  readonly rows: readonly Row[];
  readonly footer: string;
  readonly locked: boolean;
}

export function paintMenu(context: CanvasRenderingContext2D, picture: MenuPicture): void {
  box(context, { x: 0, y: 0, w: WIDTH, h: HEIGHT }, 14, INK.panel);
  paintBar(context);
  for (const { tab, rect } of tabRects()) {
    const chosen = tab === picture.tab;
    box(context, { x: rect.x, y: rect.y + 3, w: rect.w, h: rect.h - 6 }, 9, chosen ? INK.accent : INK.row);
    write(context, tab, inset(rect, 4), EM.small, chosen ? INK.onAccent : INK.soft, "center", 600);
  }
  picture.rows.forEach((row, index) => paintRow(context, row, rowRect(index)));
  write(context, picture.footer, FOOTER, EM.small, picture.locked ? INK.warn : INK.soft);
}

function paintBar(context: CanvasRenderingContext2D): void {
  context.save();
  context.beginPath();
  context.roundRect(0, 0, WIDTH, CLOSE.h, [14, 14, 0, 0]);
  context.fillStyle = INK.bar;
  context.fill();
  context.restore();
  for (const offset of [-5, 0, 5]) box(context, { x: 16, y: TITLE_BAR.h / 2 + offset - 1.2, w: 20, h: 2.4 }, 1.2, INK.faint);
  write(context, "Settings", { x: 46, y: 0, w: 220, h: TITLE_BAR.h }, EM.large, INK.text, "left", 650);
  write(context, "drag to move", { x: 200, y: 0, w: TITLE_BAR.w - 214, h: TITLE_BAR.h }, EM.small, INK.faint, "right");
  write(context, "×", CLOSE, 30, INK.text, "center", 400);
}

function paintRow(context: CanvasRenderingContext2D, row: Row, rect: Rect): void {
  if (row.kind !== "text") box(context, rect, 9, INK.row);
  const faded = row.locked !== null;
  context.globalAlpha = faded ? 0.45 : 1;
  const label = labelRect(row, rect);
  write(context, row.label, label, row.kind === "text" ? EM.small : EM.large, row.kind === "text" ? INK.soft : INK.text);
  if (row.kind === "toggle") paintSwitch(context, controlRect(row, rect), row.on);
  if (row.kind === "slider") {
    paintTrack(context, trackRect(controlRect(row, rect)), (row.value - row.low) / (row.high - row.low));
    write(context, row.text, numberRect(rect), EM.large, INK.text, "right", 600);
  }
  if (row.kind === "part") {
    context.globalAlpha = faded || !row.on ? 0.45 : 1;
    paintTrack(context, trackRect(controlRect(row, rect)), row.opacity);
    write(context, `${Math.round(100 * row.opacity)} %`, partNumberRect(rect), EM.small, INK.text, "right", 600);
    context.globalAlpha = faded ? 0.45 : 1;
    paintSwitch(context, switchRect(rect), row.on);
  }
  if (row.kind === "choice") {
    segments(row, rect).forEach((each, index) => {
      const { value, label: name } = row.choices[index]!;
      paintButton(context, each, name, value === row.value);
    });
  }
  if (row.kind === "buttons") segments(row, rect).forEach((each, index) => paintButton(context, each, row.buttons[index]!.label, row.buttons[index]!.chosen === true));
  context.globalAlpha = 1;
}

function paintSwitch(context: CanvasRenderingContext2D, at: Rect, on: boolean): void {
  box(context, at, at.h / 2, on ? INK.accent : INK.track);
  const knob = at.h - 6;
  const x = on ? at.x + at.w - knob - 3 : at.x + 3;
  box(context, { x, y: at.y + 3, w: knob, h: knob }, knob / 2, INK.text);
  const text = { x: on ? at.x + 6 : at.x + knob + 4, y: at.y, w: at.w - knob - 10, h: at.h };
  write(context, on ? "on" : "off", text, EM.small, on ? INK.onAccent : INK.soft, "center", 600);
}

function paintTrack(context: CanvasRenderingContext2D, track: Rect, share: number): void {
  box(context, track, 3, INK.track);
  box(context, { ...track, w: track.w * share }, 3, INK.accent);
  const radius = 10;
  box(context, { x: track.x + share * track.w - radius, y: track.y + 3 - radius, w: 2 * radius, h: 2 * radius }, radius, INK.text);
}

function paintButton(context: CanvasRenderingContext2D, at: Rect, name: string, chosen: boolean): void {
  box(context, at, 8, chosen ? INK.accent : INK.bar);
  if (!chosen) {
    context.strokeStyle = INK.edge;
    context.lineWidth = 1;
    context.stroke();
  }
  write(context, name, inset(at, 5), EM.small, chosen ? INK.onAccent : INK.text, "center", 600);
}

function inset(rect: Rect, by: number): Rect {
  return { x: rect.x + by, y: rect.y, w: rect.w - 2 * by, h: rect.h };
}
