/** Which of many labels are shown where they would lie over each other: pure, in any unit of the picture. */

/** Labels that are shown give way when they overlap by this share of their height; a hidden one comes back when it is this far clear. */
const OVERLAP = 0.15;
const CLEAR = 0.3;
/** And when it has been clear for so long: nothing flickers while the viewer moves. */
const PATIENCE_S = 0.2;
/** Those shown count as nearer by this share: two at the same distance do not change places. */
const FAVOUR = 0.06;
/** Time constant of coming and going. */
const EASE_S = 0.08;

export const MOST_LABELS = 96;

/** Of each label, by its number. The first eight are given, the others kept from one call to the next. */
export class LabelCrowd {
  count = 0;
  /** Middle and half the size in the picture. */
  readonly x = new Float32Array(MOST_LABELS);
  readonly y = new Float32Array(MOST_LABELS);
  readonly halfWidth = new Float32Array(MOST_LABELS);
  readonly halfHeight = new Float32Array(MOST_LABELS);
  /** From the eye; only its order matters. Not above 0: not in the picture. */
  readonly distance = new Float32Array(MOST_LABELS);
  /** 0 wins against 1, and so on, at any distance. */
  readonly rank = new Uint8Array(MOST_LABELS);
  /** How strongly each is drawn, 0 to 1. */
  readonly opacity = new Float32Array(MOST_LABELS);
  private readonly shown = new Uint8Array(MOST_LABELS);
  private readonly clearS = new Float32Array(MOST_LABELS);
  private readonly order = new Uint8Array(MOST_LABELS);
  private readonly key = new Float32Array(MOST_LABELS);
  private fresh = true;

  /** Begins with other labels: there is nothing to be gentle with. */
  restart(count: number): void {
    this.count = Math.min(count, MOST_LABELS);
    this.fresh = true;
    for (let i = 0; i < this.count; i++) this.order[i] = i;
    this.shown.fill(0);
    this.clearS.fill(0);
    this.opacity.fill(0);
  }

  /** Decides anew. Returns whether any opacity has changed. */
  settle(dtS: number): boolean {
    this.sort();
    for (let at = 0; at < this.count; at++) this.decide(this.order[at]!, at, dtS);
    const share = this.fresh ? 1 : 1 - Math.exp(-dtS / EASE_S);
    this.fresh = false;
    let changed = false;
    for (let i = 0; i < this.count; i++) {
      const wanted = this.shown[i]!;
      const now = this.opacity[i]!;
      if (now === wanted) continue;
      const next = now + share * (wanted - now);
      this.opacity[i] = Math.abs(wanted - next) < 0.01 ? wanted : next;
      changed = true;
    }
    return changed;
  }

  isShown(i: number): boolean {
    return this.shown[i] === 1;
  }

  private decide(i: number, at: number, dtS: number): void {
    const was = this.shown[i] === 1;
    let free = this.distance[i]! > 0;
    const margin = (was ? -OVERLAP : CLEAR) * 2 * this.halfHeight[i]!;
    for (let before = 0; free && before < at; before++) {
      const other = this.order[before]!;
      if (this.shown[other] === 0) continue;
      free = Math.abs(this.x[i]! - this.x[other]!) > this.halfWidth[i]! + this.halfWidth[other]! + margin
        || Math.abs(this.y[i]! - this.y[other]!) > this.halfHeight[i]! + this.halfHeight[other]! + margin;
    }
    this.clearS[i] = free ? this.clearS[i]! + dtS : 0;
    this.shown[i] = free && (was || this.fresh || this.clearS[i]! >= PATIENCE_S) ? 1 : 0;
  }

  /** By rank, then by distance. Insertion into the last order: nearly always nothing moves. */
  private sort(): void {
    const { key, order, count } = this;
    for (let i = 0; i < count; i++) {
      const distance = this.distance[i]! * (this.shown[i] === 1 ? 1 - FAVOUR : 1);
      key[i] = this.rank[i]! + distance / (1 + distance); // the second part is between 0 and 1
    }
    for (let i = 1; i < count; i++) {
      const moving = order[i]!;
      let at = i;
      for (; at > 0 && key[order[at - 1]!]! > key[moving]!; at--) order[at] = order[at - 1]!;
      order[at] = moving;
    }
  }
}
