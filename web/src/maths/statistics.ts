/** Running figures for the panel: rates and percentiles over the last moments. */

/** How often something happens, from the instants of its last occurrences. */
export class RateMeter {
  private readonly instants: Float64Array;
  private count = 0;

  constructor(private readonly windowS = 2, capacity = 256) {
    this.instants = new Float64Array(capacity);
  }

  mark(nowS: number): void {
    this.instants[this.count++ % this.instants.length] = nowS;
  }

  /** Returns occurrences per second over the window; 0 when there were fewer than two. */
  rate(nowS: number): number {
    const kept = Math.min(this.count, this.instants.length);
    let oldest = nowS;
    let newest = 0;
    let inside = 0;
    for (let back = 1; back <= kept; back++) {
      const instant = this.instants[(this.count - back) % this.instants.length]!;
      if (nowS - instant > this.windowS) break;
      if (inside++ === 0) newest = instant;
      oldest = instant;
    }
    return inside < 2 || newest <= oldest ? 0 : (inside - 1) / (newest - oldest);
  }

  clear(): void {
    this.count = 0;
  }
}

/** The last values of a quantity, for percentiles. */
export class Recent {
  private readonly values: Float64Array;
  private readonly sorted: Float64Array;
  private count = 0;

  constructor(capacity = 128) {
    this.values = new Float64Array(capacity);
    this.sorted = new Float64Array(capacity);
  }

  add(value: number): void {
    this.values[this.count++ % this.values.length] = value;
  }

  /** Returns the value below which a share (0 to 1) of the last values lies; null when there are none. */
  percentile(share: number): number | null {
    const kept = Math.min(this.count, this.values.length);
    if (kept === 0) return null;
    this.sorted.set(this.values);
    const sorted = this.sorted.subarray(0, kept).sort();
    return sorted[Math.min(kept - 1, Math.floor(share * kept))]!;
  }

  clear(): void {
    this.count = 0;
  }
}

/**
 * Returns the number that would be at `rank` (from 0) if the first `count` ones were in ascending order (Hoare's
 * selection). Moves numbers about; allocates nothing.
 */
export function nth(numbers: Float64Array, count: number, rank: number): number {
  let low = 0;
  let high = count - 1;
  while (low < high) {
    const pivot = numbers[(low + high) >> 1]!;
    let i = low;
    let j = high;
    while (i <= j) {
      while (numbers[i]! < pivot) i += 1;
      while (numbers[j]! > pivot) j -= 1;
      if (i > j) break;
      const moved = numbers[i]!;
      numbers[i++] = numbers[j]!;
      numbers[j--] = moved;
    }
    if (rank <= j) high = j;
    else if (rank >= i) low = i;
    else return numbers[rank]!;
  }
  return numbers[rank]!;
}
