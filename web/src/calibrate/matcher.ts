/** Pairs pictures with what was found in them: the corners are drawn on the very picture they belong to. */

export interface Numbered {
  readonly seq: number;
}

/** A picture waits for its corners only while corners keep coming. */
export const HOLD_MS = 400;
const MOST_WAITING = 8;

export class Matcher<P extends Numbered> {
  /** The picture to show; null before the first. */
  shown: P | null = null;
  private waiting: P[] = [];
  private wanted = -1;
  private matchedAtMs = -Infinity;

  /** `release` gets every picture that is shown no more, and those that never were. */
  constructor(private readonly release: (picture: P) => void) {}

  /** Takes a new picture; returns whether another one is shown now. */
  put(picture: P, nowMs: number): boolean {
    const matches = picture.seq === this.wanted;
    if (matches || nowMs - this.matchedAtMs >= HOLD_MS) {
      if (matches) this.matchedAtMs = nowMs;
      this.show(picture);
      return true;
    }
    this.waiting.push(picture);
    if (this.waiting.length > MOST_WAITING) this.release(this.waiting.shift()!);
    return false;
  }

  /** Hears in which picture corners were looked for last; returns whether another picture is shown now. */
  want(seq: number, nowMs: number): boolean {
    this.wanted = seq;
    const found = this.waiting.find((picture) => picture.seq === seq);
    if (found === undefined) {
      if (this.shown?.seq === seq) this.matchedAtMs = nowMs;
      return false;
    }
    this.matchedAtMs = nowMs;
    this.show(found);
    return true;
  }

  clear(): void {
    this.dropWaiting(null);
    if (this.shown !== null) this.release(this.shown);
    this.shown = null;
    this.wanted = -1;
    this.matchedAtMs = -Infinity;
  }

  private show(picture: P): void {
    this.dropWaiting(picture);
    if (this.shown !== null && this.shown !== picture) this.release(this.shown);
    this.shown = picture;
  }

  /** Lets go of what is older than `picture`, of all without one. */
  private dropWaiting(picture: P | null): void {
    const kept = picture === null ? [] : this.waiting.filter((each) => each !== picture && each.seq > picture.seq);
    for (const each of this.waiting) if (each !== picture && !kept.includes(each)) this.release(each);
    this.waiting = kept;
  }
}
