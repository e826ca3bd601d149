/** What is drawn over the picture while a lens is measured: the coverage map and the board's corners. */

import type { IntrinsicsState } from "../generated/messages";
import { cellAlpha, cellBox } from "./coverage";
import { toCanvas } from "./fit";
import type { Canvas } from "./live_picture";
import type { Look } from "./intrinsics_look";

/** Corners of a picture this many pictures ago still show where the board is. */
const OLD_PICTURES = 4;
const FILL = "69, 211, 154";
const CORNERS: Partial<Record<Look, string>> = {
  known: "#c3cfdb", hold: "#ffb454", capturing: "#4cc2ff", captured: "#45d39a",
};

export function drawBoardOverlay(on: Canvas, state: IntrinsicsState, look: Look, withCoverage: boolean): void {
  if (withCoverage) drawCoverage(on, state);
  if (state.stage === "collecting" && Math.abs(on.seq - state.corners_seq) <= OLD_PICTURES) drawCorners(on, state, look);
}

function drawCoverage({ context, fit, picture }: Canvas, { coverage }: IntrinsicsState): void {
  for (let index = 0; index < coverage.counts.length; index++) {
    const cell = cellBox(coverage, index, picture);
    const x = fit.left + cell.left * fit.scale;
    const y = fit.top + cell.top * fit.scale;
    const width = cell.width * fit.scale;
    const height = cell.height * fit.scale;
    const alpha = cellAlpha(coverage.counts[index]!);
    if (alpha > 0) {
      context.fillStyle = `rgba(${FILL}, ${alpha})`;
      context.fillRect(x + 1, y + 1, width - 2, height - 2);
    }
    context.lineWidth = 1;
    context.setLineDash(alpha > 0 ? [] : [3, 5]);
    context.strokeStyle = alpha > 0 ? `rgba(${FILL}, 0.55)` : "rgba(139, 155, 173, 0.5)";
    context.strokeRect(Math.round(x) + 1.5, Math.round(y) + 1.5, Math.round(width) - 3, Math.round(height) - 3);
  }
  context.setLineDash([]);
}

function drawCorners({ context, fit, canvas }: Canvas, state: IntrinsicsState, look: Look): void {
  const radius = Math.max(3, Math.min(6, canvas.width / 220));
  const path = new Path2D();
  for (const corner of state.corners_px) {
    const [x, y] = toCanvas(fit, corner);
    path.moveTo(x + radius, y);
    path.arc(x, y, radius, 0, 2 * Math.PI);
  }
  context.lineWidth = radius * 0.95;
  context.strokeStyle = "rgba(4, 10, 16, 0.75)";
  context.stroke(path);
  context.lineWidth = radius * 0.45;
  context.strokeStyle = CORNERS[look] ?? "#ffffff";
  context.stroke(path);
}
