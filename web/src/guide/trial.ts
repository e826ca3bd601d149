/** Measures whether somebody has done what a step asks for. Pure; allocates nothing while it runs. */

import type { Measured } from "./situation";

/** What a step waits for. `read`: nothing but that it has been read. */
export type Task =
  | { readonly kind: "read" }
  | { readonly kind: "taken" }
  | { readonly kind: "inserted"; readonly mm: number }
  | { readonly kind: "rolled"; readonly deg: number }
  | { readonly kind: "flexed"; readonly deg: number }
  | { readonly kind: "turned"; readonly deg: number }
  | { readonly kind: "moved"; readonly cm: number }
  | { readonly kind: "sized"; readonly percent: number }
  | { readonly kind: "setting"; readonly menu: boolean }
  | { readonly kind: "pictures"; readonly seconds: number }
  | { readonly kind: "reached" };

/** Noise of the tracking is smoothed over this; a hand's motion is not. */
const SMOOTH_S = 0.15;
/** A first touch counts from here on: more than noise, less than an exercise. */
const TAKEN_MM = 3;
const TAKEN_DEG = 10;
/**
 * Bend is measured while the catheter is neither pushed nor rolled further than this: the bend of what is in the box
 * changes by itself when more of it comes in, and a real catheter's tip does not turn exactly with its handle.
 */
const FLEX_PUSH_MM = 8;
const FLEX_ROLL_DEG = 30;
const RAD = Math.PI / 180;

/** The span between the least and the greatest value seen; what happens while nothing is seen does not count. */
class Span {
  have = 0;
  private value = NaN;
  private low = NaN;
  private high = NaN;
  private missed = false;

  clear(): void {
    this.have = 0;
    this.value = this.low = this.high = NaN;
  }

  /** What happens until the next value is not seen. */
  interrupt(): void {
    this.missed = true;
  }

  put(value: number, share: number): void {
    if (Number.isNaN(this.value)) this.value = this.low = this.high = value;
    if (this.missed) {
      const moved = value - this.value; // nobody saw how: it goes on from there
      this.low += moved;
      this.high += moved;
      this.value = value;
    }
    this.missed = false;
    this.value += share * (value - this.value);
    if (this.value < this.low) this.low = this.value;
    if (this.value > this.high) this.high = this.value;
    if (this.high - this.low > this.have) this.have = this.high - this.low;
  }
}

/** How far the tip is bent another way than at the beginning, roll taken out. */
class Flex {
  have = 0;
  private begun = false;
  private missed = false;
  private rolled = false;
  private x = 0;
  private y = 0;
  private x0 = 0;
  private y0 = 0;
  private inserted0 = 0;
  private roll0 = 0;

  clear(): void {
    this.have = 0;
    this.begun = false;
  }

  interrupt(): void {
    this.missed = true;
  }

  put(now: Measured, share: number): void {
    const roll = now.rollDeg ?? 0;
    const towards = (now.bendTowardsDeg - roll) * RAD; // seen from the catheter itself
    const x = now.bendDeg * Math.cos(towards);
    const y = now.bendDeg * Math.sin(towards);
    const known = now.rollDeg !== null;
    const pushed = Math.abs(now.insertedMm - this.inserted0) > FLEX_PUSH_MM;
    const rolled = Math.abs(roll - this.roll0) > FLEX_ROLL_DEG || known !== this.rolled;
    if (!this.begun || pushed || rolled) {
      this.begun = true;
      this.rolled = known;
      this.x = this.x0 = x;
      this.y = this.y0 = y;
      this.inserted0 = now.insertedMm;
      this.roll0 = roll;
      this.missed = false;
      return;
    }
    if (this.missed) {
      this.x0 += x - this.x;
      this.y0 += y - this.y;
      this.x = x;
      this.y = y;
    }
    this.missed = false;
    this.x += share * (x - this.x);
    this.y += share * (y - this.y);
    // Without a roll only the size of the bend says something: turning a bent tip round does not change it.
    const changed = known
      ? Math.hypot(this.x - this.x0, this.y - this.y0)
      : Math.abs(Math.hypot(this.x, this.y) - Math.hypot(this.x0, this.y0));
    if (changed > this.have) this.have = changed;
  }
}

export class Trial {
  /** How much of what is asked for has been done, in the task's own unit. */
  have = 0;
  need = 1;
  /** Between 0 and 1. */
  share = 0;
  /** For the target: how far it still is, mm. */
  leftMm: number | null = null;
  within = false;
  /** Why what is done now does not count. */
  blocked: "" | "unseen" | "script" | "roll" = "";
  task: Task = { kind: "read" };
  private readonly inserted = new Span();
  private readonly rolled = new Span();
  private readonly azimuth = new Span();
  private readonly height = new Span();
  private readonly size = new Span();
  private readonly flex = new Flex();
  private readonly heart0 = new Float64Array(3);
  private moving = false;
  private movedBefore = 0;
  private changes0 = -1;
  private opened = false;
  private onS = 0;
  private offS = 0;
  private farthestMm = 0;

  /** Begins to measure for a task; nothing from before counts. */
  begin(task: Task): void {
    this.task = task;
    this.have = this.share = 0;
    this.need = needOf(task);
    this.leftMm = null;
    this.blocked = "";
    this.within = this.moving = this.opened = false;
    this.movedBefore = this.onS = this.offS = this.farthestMm = 0;
    this.changes0 = -1;
    for (const each of [this.inserted, this.rolled, this.azimuth, this.height, this.size, this.flex]) each.clear();
  }

  /** Takes a frame; returns whether the task is done. */
  update(now: Measured): boolean {
    this.measure(now);
    this.share = this.task.kind === "reached" ? this.approach() : Math.min(1, this.have / this.need);
    return this.task.kind !== "read" && this.have >= this.need;
  }

  private measure(now: Measured): void {
    switch (this.task.kind) {
      case "taken":
      case "inserted":
      case "rolled":
      case "flexed":
        this.measureCatheter(now);
        break;
      case "turned":
      case "sized":
        this.measureView(now);
        break;
      case "moved":
        this.measureHeart(now);
        break;
      case "setting":
        this.measureSettings(now, this.task.menu);
        break;
      case "pictures":
        if (now.ice) this.onS += now.dtS;
        else this.offS += now.dtS;
        this.have = (this.onS >= this.task.seconds ? 1 : 0) + (this.offS >= this.task.seconds ? 1 : 0);
        break;
      case "reached":
        this.leftMm = now.targetMm;
        this.within = now.targetWithin;
        if (now.targetMm !== null) this.farthestMm = Math.max(this.farthestMm, now.targetMm);
        this.have = now.targetReached && now.targetMm !== null ? 1 : 0;
        break;
    }
  }

  private measureCatheter(now: Measured): void {
    const { inserted, rolled, flex } = this;
    const { kind } = this.task;
    this.blocked = !now.known ? "unseen" : !now.steered && kind !== "taken" ? "script" : now.rollDeg === null && kind === "rolled" ? "roll" : "";
    if (!now.known || !now.steered) {
      inserted.interrupt();
      rolled.interrupt();
      flex.interrupt();
      return;
    }
    const share = 1 - Math.exp(-now.dtS / SMOOTH_S);
    inserted.put(now.insertedMm, share);
    if (now.rollDeg === null) rolled.interrupt();
    else rolled.put(now.rollDeg, share);
    if (kind === "flexed") flex.put(now, share);
    if (kind === "taken") this.have = Math.max(inserted.have / TAKEN_MM, rolled.have / TAKEN_DEG);
    else this.have = kind === "inserted" ? inserted.have : kind === "rolled" ? rolled.have : flex.have;
  }

  private measureView(now: Measured): void {
    const { azimuth, height, size } = this;
    if (!now.handMoved) {
      for (const each of [azimuth, height, size]) each.interrupt();
      return;
    }
    if (this.task.kind === "sized") {
      size.put(Math.log(now.size), 1);
      this.have = 100 * (Math.exp(size.have) - 1);
    } else {
      azimuth.put(now.azimuthDeg, 1);
      height.put(now.heightDeg, 1);
      this.have = Math.max(azimuth.have, height.have);
    }
  }

  /** Adds up how far each hold has carried the heart. */
  private measureHeart(now: Measured): void {
    if (!now.handMoved) {
      if (this.moving) this.movedBefore = this.have;
      this.moving = false;
      return;
    }
    const { heartCm } = now;
    if (!this.moving) this.heart0.set(heartCm);
    this.moving = true;
    const away = Math.hypot(heartCm[0]! - this.heart0[0]!, heartCm[1]! - this.heart0[1]!, heartCm[2]! - this.heart0[2]!);
    if (this.movedBefore + away > this.have) this.have = this.movedBefore + away;
  }

  private measureSettings(now: Measured, menu: boolean): void {
    if (this.changes0 < 0) this.changes0 = now.changes;
    if (now.menuOpen || !menu) this.opened = true;
    const changed = now.changes > this.changes0 && this.opened ? 1 : 0;
    this.have = menu ? (this.opened ? 1 : 0) + changed : changed;
  }

  private approach(): number {
    if (this.have >= 1) return 1;
    if (this.leftMm === null || this.farthestMm <= 0) return 0;
    return Math.max(0, Math.min(0.99, 1 - this.leftMm / this.farthestMm));
  }
}

function needOf(task: Task): number {
  switch (task.kind) {
    case "inserted": return task.mm;
    case "rolled":
    case "flexed":
    case "turned": return task.deg;
    case "moved": return task.cm;
    case "sized": return task.percent;
    case "setting": return task.menu ? 2 : 1;
    case "pictures": return 2;
    default: return 1;
  }
}

const BLOCKED = {
  unseen: "The catheter is not seen",
  script: "It still moves by itself",
  roll: "Roll is not known yet",
} as const;

/** Returns how far a task has come, for people; empty where there is nothing to count. */
export function progressText(trial: Trial): string {
  const have = Math.min(Math.floor(trial.have + 1e-6), trial.need);
  if (trial.blocked !== "") return BLOCKED[trial.blocked];
  switch (trial.task.kind) {
    case "inserted": return `${have} of ${trial.need} mm`;
    case "rolled":
    case "flexed":
    case "turned": return `${have} of ${trial.need}°`;
    case "moved": return `${have} of ${trial.need} cm`;
    case "sized": return `${have} of ${trial.need} %`;
    case "pictures": return `${have} of 2 pictures seen`;
    case "setting":
      if (!trial.task.menu) return "";
      return have === 0 ? "Open the menu" : "The menu is open: now change something";
    case "reached":
      if (trial.leftMm === null) return "The tip is not seen";
      return trial.within ? "You are there: hold still" : `${Math.round(trial.leftMm)} mm to go`;
    default: return "";
  }
}
