/** The outlines of labels in a slice, by marching squares. */

/** Per label: x, y of one end and x, y of the other, of each piece; (column, row), pixel centres are whole numbers. */
export type Contours = ReadonlyMap<number, readonly number[]>;

// Ends of the pieces by which corners of a cell are inside (1 upper left, 2 upper right, 4 lower right, 8 lower left):
// the middles of the cell's upper (0), right (1), lower (2) and left (3) side.
const PIECES: readonly (readonly number[])[] = [
  [], [3, 0], [0, 1], [3, 1], [1, 2], [3, 0, 1, 2], [0, 2], [3, 2],
  [3, 2], [0, 2], [0, 1, 3, 2], [1, 2], [3, 1], [0, 1], [3, 0], [],
];
const MIDDLE_X = [0.5, 1, 0.5, 0];
const MIDDLE_Y = [0, 0.5, 1, 0.5];

/** Returns the outlines; what touches the slice's edge is closed there. */
export function contoursOf(labels: Uint8Array, columns: number, rows: number): Contours {
  const found = new Map<number, number[]>();
  for (let row = -1; row < rows; row += 1) {
    for (let column = -1; column < columns; column += 1) {
      const up = row >= 0;
      const down = row + 1 < rows;
      const left = column >= 0;
      const right = column + 1 < columns;
      const at = row * columns + column;
      const a = up && left ? labels[at]! : 0;
      const b = up && right ? labels[at + 1]! : 0;
      const c = down && right ? labels[at + columns + 1]! : 0;
      const d = down && left ? labels[at + columns]! : 0;
      if (a === b && b === c && c === d) continue;
      add(found, a, a, b, c, d, column, row);
      if (b !== a) add(found, b, a, b, c, d, column, row);
      if (c !== a && c !== b) add(found, c, a, b, c, d, column, row);
      if (d !== a && d !== b && d !== c) add(found, d, a, b, c, d, column, row);
    }
  }
  return found;
}

function add(
  found: Map<number, number[]>, label: number, a: number, b: number, c: number, d: number, column: number, row: number,
): void {
  if (label === 0) return;
  const inside = Number(a === label) + 2 * Number(b === label) + 4 * Number(c === label) + 8 * Number(d === label);
  let ends = found.get(label);
  if (ends === undefined) found.set(label, (ends = []));
  for (const side of PIECES[inside]!) ends.push(column + MIDDLE_X[side]!, row + MIDDLE_Y[side]!);
}
