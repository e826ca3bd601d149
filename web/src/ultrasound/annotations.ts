/** What stands around an ultrasound picture: depth scale, marks along the sector, orientation marker, settings. */

import type { IceSettings } from "./settings";

/** A sector laid out on a canvas: where mm of the frame `transducer` are, in pixels. */
export interface Layout {
  readonly pxPerMm: number;
  /** Of the middle of the transducer's face. */
  readonly x: number;
  readonly y: number;
  /** -1: distal is on the left, 1: on the right. */
  readonly distal: -1 | 1;
}

export const MARGIN = { top: 54, side: 58, bottom: 34 } as const;
const INK = "#d7dee6";
const DIM = "rgba(215, 222, 230, 0.55)";
const MARKER = "#57e389";

/** Returns the layout that fits a sector into a canvas of a width and height in pixels. */
export function layout(settings: IceSettings, width: number, height: number, distalLeft: boolean): Layout {
  const half = Math.min(settings.sectorRad / 2, Math.PI / 2);
  const wideMm = 2 * (settings.apexMm + settings.depthMm) * Math.sin(half);
  const highMm = settings.depthMm + settings.apexMm * (1 - Math.cos(half));
  const pxPerMm = Math.min((width - 2 * MARGIN.side) / wideMm, (height - MARGIN.top - MARGIN.bottom) / highMm);
  const above = settings.apexMm * (1 - Math.cos(half)) * pxPerMm;
  return { pxPerMm, x: width / 2, y: MARGIN.top + above, distal: distalLeft ? -1 : 1 };
}

/** Returns the distance between labelled depths, mm: at most nine of them. */
export function depthStep(depthMm: number): number {
  for (const step of [5, 10, 20, 50]) if (depthMm / step <= 9) return step;
  return 100;
}

/** What stands beside the picture: whether it is held, how many there are a second, and why there is none, in words. */
export interface PanelState {
  readonly frozen: boolean;
  readonly hz: number;
  /** Empty: there is a picture. */
  readonly message: string;
  /** Name and colour of what is coloured; empty: nothing is. */
  readonly legend: readonly (readonly [name: string, colour: string])[];
}

/** Draws everything around the picture; what lies behind stays. width, height: of the canvas, in the layout's pixels. */
export function annotate(
  context: CanvasRenderingContext2D, settings: IceSettings, at: Layout, state: PanelState, width: number, height: number,
): void {
  context.clearRect(0, 0, width, height);
  context.lineWidth = 1.5;
  context.font = "16px system-ui, sans-serif";
  context.textBaseline = "middle";
  drawDepths(context, settings, at);
  drawAngles(context, settings, at);
  drawMarker(context, at);
  context.textAlign = "left";
  context.fillStyle = INK;
  context.fillText(`${settings.frequencyMHz.toFixed(1)} MHz   ${Math.round(settings.depthMm)} mm`, 12, 18);
  context.fillText(`Gain ${signed(settings.gainDb)} dB`, 12, 40);
  context.fillText(`DR ${Math.round(settings.dynamicRangeDb)} dB`, 12, 62);
  context.textAlign = "right";
  context.fillStyle = state.frozen ? "#ffb454" : INK;
  context.fillText(state.frozen ? "FROZEN" : `${Math.round(state.hz)} Hz`, width - 12, 18);
  context.fillStyle = DIM;
  context.font = "13px system-ui, sans-serif";
  context.fillText("simulated, for training only", width - 10, height - 14);
  drawLegend(context, state.legend, width);
  if (state.message !== "") drawMessage(context, state.message, width, height);
}

/** Returns a name as echocardiographers write it: the initials of several words (`LV`), one word as it is. */
export function shortName(name: string): string {
  const words = name.split(/[\s-]+/).filter((word) => word !== "");
  return words.length < 2 ? name : words.map((word) => word[0]!.toUpperCase()).join("");
}

/** Names beside colours, half of them in each upper corner: there the sector leaves room for four short rows, not for eight. */
function drawLegend(context: CanvasRenderingContext2D, legend: PanelState["legend"], width: number): void {
  context.font = "14px system-ui, sans-serif";
  const rows = Math.ceil(legend.length / 2);
  for (const [at, [name, colour]] of legend.entries()) {
    const onRight = at >= rows;
    const y = 90 + 19 * (onRight ? at - rows : at);
    context.textAlign = onRight ? "right" : "left";
    context.fillStyle = colour;
    context.fillRect(onRight ? width - 23 : 12, y - 6, 11, 11);
    context.fillStyle = INK;
    context.fillText(shortName(name), onRight ? width - 29 : 29, y);
  }
}

/** Words in the middle, broken where a line is full. */
function drawMessage(context: CanvasRenderingContext2D, message: string, width: number, height: number): void {
  context.font = "600 22px system-ui, sans-serif";
  context.textAlign = "center";
  const lines: string[] = [];
  for (const word of message.split(" ")) {
    const longer = lines.length === 0 ? word : `${lines[lines.length - 1]!} ${word}`;
    if (lines.length > 0 && context.measureText(longer).width < 0.72 * width) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  const top = 0.55 * height - 15 * lines.length;
  context.fillStyle = "rgba(5, 8, 12, 0.86)";
  context.fillRect(0.08 * width, top - 26, 0.84 * width, 30 * lines.length + 38);
  context.fillStyle = "#ffb454";
  for (const [row, line] of lines.entries()) context.fillText(line, width / 2, top + 8 + 30 * row);
}

/** Depths along both edges of the sector, every tenth of a step's double, with numbers in mm on the right. */
function drawDepths(context: CanvasRenderingContext2D, settings: IceSettings, at: Layout): void {
  const step = depthStep(settings.depthMm);
  const half = settings.sectorRad / 2;
  context.strokeStyle = DIM;
  context.fillStyle = INK;
  context.textAlign = "left";
  for (let mm = 0; mm <= settings.depthMm + 1e-6; mm += step / 2) {
    const labelled = Math.abs(mm / step - Math.round(mm / step)) < 1e-6;
    for (const side of [-1, 1]) {
      const [x, y] = pixel(settings, at, mm, side * half);
      const [dx, dy] = [Math.cos(half) * Math.sign(x - at.x || side), -Math.sin(half)];
      const long = labelled ? 9 : 5;
      line(context, x, y, x + long * dx, y + long * dy);
      if (labelled && mm > 0 && x > at.x) context.fillText(`${mm}`, x + 14 * dx, y + 14 * dy);
    }
  }
}

/** Marks along the far edge, every 15 degrees, longer in the middle: the beam's direction. */
function drawAngles(context: CanvasRenderingContext2D, settings: IceSettings, at: Layout): void {
  context.strokeStyle = DIM;
  const most = Math.floor((settings.sectorRad / 2) / (Math.PI / 12) + 1e-6);
  for (let i = -most; i <= most; i++) {
    const [x, y] = pixel(settings, at, settings.depthMm, (i * Math.PI) / 12);
    const [farX, farY] = pixel(settings, at, settings.depthMm + (i === 0 ? 11 : 6) / at.pxPerMm, (i * Math.PI) / 12);
    line(context, x, y, farX, farY);
  }
}

/** The marker beside the transducer on its distal side: a ring with D for distal. */
function drawMarker(context: CanvasRenderingContext2D, at: Layout): void {
  const x = at.x + at.distal * 40;
  const y = at.y - 4;
  context.strokeStyle = context.fillStyle = MARKER;
  context.lineWidth = 2.5;
  context.beginPath();
  context.arc(x, y, 12, 0, 2 * Math.PI);
  context.stroke();
  context.lineWidth = 1.5;
  context.textAlign = "center";
  context.fillText("D", x, y + 1);
}

/** Returns the pixel of a point by its depth (mm) and its line's angle (rad, distal positive). */
export function pixel(settings: IceSettings, at: Layout, depthMm: number, angle: number): [number, number] {
  const reach = settings.apexMm + depthMm;
  return [
    at.x + at.distal * at.pxPerMm * reach * Math.sin(angle),
    at.y + at.pxPerMm * (reach * Math.cos(angle) - settings.apexMm),
  ];
}

function line(context: CanvasRenderingContext2D, x: number, y: number, toX: number, toY: number): void {
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(toX, toY);
  context.stroke();
}

function signed(value: number): string {
  return `${value > 0 ? "+" : value < 0 ? "−" : ""}${Math.abs(Math.round(value))}`;
}
