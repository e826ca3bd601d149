/** The small line that shows how a metric has gone over one's own trials. Pure geometry. */

export interface Spark {
  /** x y of each trial, one after another, within width and height. */
  readonly points: readonly (readonly [number, number])[];
  /** SVG path through them; empty below two trials. */
  readonly path: string;
}

const MARGIN = 3;

/** Returns the line through the last trials of a history, the best end up. most: trials that there is room for. */
export function spark(history: readonly (readonly [number, number])[], higherUp: boolean, width: number, height: number, most = 12): Spark {
  const values = history.slice(-most).map(([, value]) => value).filter((value) => Number.isFinite(value));
  if (values.length === 0) return { points: [], path: "" };
  const low = Math.min(...values);
  const span = Math.max(...values) - low;
  const across = width - 2 * MARGIN;
  const down = height - 2 * MARGIN;
  const points = values.map((value, i): readonly [number, number] => {
    const share = span === 0 ? 0.5 : (value - low) / span;
    const x = values.length === 1 ? MARGIN + across : MARGIN + (across * i) / (values.length - 1);
    return [round(x), round(MARGIN + down * (higherUp ? 1 - share : share))];
  });
  const path = points.length < 2 ? "" : `M${points.map(([x, y]) => `${x} ${y}`).join("L")}`;
  return { points, path };
}

function round(value: number): number {
  return Math.round(10 * value) / 10;
}
