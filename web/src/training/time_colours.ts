/** Colours for time: from early (blue) to late (yellow), equally bright steps for all eyes. Pure. */

/** Viridis (van der Walt and Smith 2015) without its dark end, at equal steps; sRGB, 0 to 1. */
const STOPS: readonly (readonly [number, number, number])[] = [
  [0.254, 0.265, 0.53], [0.164, 0.471, 0.558], [0.135, 0.659, 0.518], [0.478, 0.821, 0.318], [0.993, 0.906, 0.144],
];

/** Writes the colour of a share of the time, 0 to 1, to three numbers of `out` from `at` on. */
export function timeColour(out: Float32Array | number[], at: number, share: number): void {
  const along = Math.min(1, Math.max(0, share)) * (STOPS.length - 1);
  const low = Math.min(STOPS.length - 2, Math.floor(along));
  const a = STOPS[low]!;
  const b = STOPS[low + 1]!;
  for (let i = 0; i < 3; i++) out[at + i] = a[i]! + (along - low) * (b[i]! - a[i]!);
}

/** Returns the samples to draw a bead at: at least `apartMm` apart, at most `most`, gaps left out. */
export function beads(tip: readonly (readonly [number, number, number] | null)[], apartMm: number, most: number): number[] {
  let apart = apartMm;
  for (;;) {
    const found = sieve(tip, apart);
    if (found.length <= most) return found;
    apart *= 1.5;
  }
}

function sieve(tip: readonly (readonly [number, number, number] | null)[], apartMm: number): number[] {
  const found: number[] = [];
  let last: readonly [number, number, number] | null = null;
  tip.forEach((at, i) => {
    if (at === null) return;
    if (last !== null && Math.hypot(at[0] - last[0], at[1] - last[1], at[2] - last[2]) < apartMm) return;
    last = at;
    found.push(i);
  });
  return found;
}
