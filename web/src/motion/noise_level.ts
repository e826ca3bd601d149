/** How much of what a stream of measurements does is noise, told from the stream itself. */

/** Of the measurements' second differences so many lie below the level: a motion that brakes or swings raises few of them. */
const SHARE = 0.25;
/** A quarter of the squares of normal noise in 3 and 2 dimensions is below this much of their mean (chi squared). */
const QUARTER = { 3: 0.404, 2: 0.288 } as const;
/** How fast the level follows, natural units a measurement: down three times as fast as up. */
const STEP = 0.08;

/**
 * Follows the standard deviation per axis of noise that is independent from one measurement to the next. It looks at how
 * far each measurement is from where the two before point to, which an even motion does not change.
 */
export class NoiseLevel {
  private level: number;

  /** dimensions: how many directions the noise has; least, first: in the unit of what is measured. */
  constructor(private readonly dimensions: 2 | 3, private readonly least: number, private readonly first: number) {
    this.level = first;
  }

  get value(): number {
    return this.level;
  }

  clear(): void {
    this.level = this.first;
  }

  /**
   * Takes the square of one second difference. ratio: the last interval over the one before; most: what the noise cannot be
   * more than.
   */
  step(squared: number, ratio: number, most: number): void {
    const variances = 1 + (1 + ratio) ** 2 + ratio ** 2;
    const quiet = squared < QUARTER[this.dimensions] * this.dimensions * variances * this.level ** 2;
    const level = this.level * Math.exp(quiet ? -STEP * (1 - SHARE) : STEP * SHARE);
    this.level = Math.max(this.least, Math.min(most, level));
  }
}
