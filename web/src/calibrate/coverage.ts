/** The coverage map: where in the picture the board has been, cell by cell. */

import type { Coverage } from "../generated/messages";
import type { Box, Size } from "./fit";

/** Corners in a cell after which more of them hardly count. */
const PLENTY = 12;
const FAINTEST = 0.1;
const STRONGEST = 0.36;

/** Returns a cell's place in the picture, in picture pixels from its upper left corner. */
export function cellBox(coverage: Coverage, index: number, picture: Size): Box {
  const width = picture.width / coverage.columns;
  const height = picture.height / coverage.rows;
  return { left: (index % coverage.columns) * width, top: Math.floor(index / coverage.columns) * height, width, height };
}

/** Returns how opaque a cell is drawn: 0 without any corner, then from faint to strong, never hiding the picture. */
export function cellAlpha(count: number): number {
  if (count <= 0) return 0;
  return FAINTEST + (STRONGEST - FAINTEST) * (1 - Math.exp(-count / PLENTY));
}

/** Returns how many cells hold a corner, and of how many. */
export function filled(coverage: Coverage): { filled: number; of: number } {
  return { filled: coverage.counts.filter((count) => count > 0).length, of: coverage.columns * coverage.rows };
}
