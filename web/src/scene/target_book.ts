/** The places to reach: those of the scene, and those that a person has placed. */

import { Matrix4, Vector3 } from "three";
import type { SceneDescription, TargetDescription } from "../generated/messages";
import { ctFromBox } from "../maths/registration";
import type { ReachRule } from "../maths/target";

export interface Target {
  /** Its own within the book. */
  readonly id: string;
  /** For people. */
  readonly name: string;
  /** mm, `box`. */
  readonly position: Vector3;
  readonly radiusMm: number;
  /** Placed by a person, who may take it away again. */
  readonly own: boolean;
  /** What it takes to reach it, where that is not the usual. Such a target is not kept for the next visit. */
  readonly rule?: ReachRule;
}

/** As it is kept for the next visit: mm in the heart's own frame, so that a new registration moves it along. */
interface Kept {
  readonly name: string;
  readonly at: readonly [number, number, number];
  readonly radiusMm: number;
}

const KEPT_AS = "cathxr.targets";
export const OWN_RADIUS_MM = 5;
const MOST_OWN = 24;

export class TargetBook {
  private list: Target[] = [];
  private chosen = "";
  private key = "";
  private placed = 0;
  private readonly heartFromBox = new Matrix4();
  private readonly boxFromHeart = new Matrix4();
  private readonly listeners = new Set<() => void>();
  /** Counts changes, for whoever draws the list. */
  version = 0;

  constructor(private readonly storage: Storage | null = null) {}

  get targets(): readonly Target[] {
    return this.list;
  }

  /** The target in force; null where there are none. */
  get active(): Target | null {
    return this.list.find(({ id }) => id === this.chosen) ?? this.list[0] ?? null;
  }

  /** Takes the targets of a scene, and the own ones that were placed in its heart before. */
  describe(scene: SceneDescription): void {
    this.heartFromBox.identity();
    if (scene.heart !== null) ctFromBox(this.heartFromBox, scene.heart.registration);
    this.boxFromHeart.copy(this.heartFromBox).invert();
    this.key = `${KEPT_AS}:${scene.heart?.attribution ?? ""}`;
    this.list = [...scene.targets.map(fromScene), ...this.kept().map((each) => this.own(each))];
    this.change();
  }

  /** Places a target at a point of `box`, mm, and makes it the one in force; null when there are too many already. */
  add(point: Vector3, radiusMm = OWN_RADIUS_MM): Target | null {
    if (this.list.filter(({ own }) => own).length >= MOST_OWN) return null;
    const at = point.clone().applyMatrix4(this.heartFromBox);
    const target = this.own({ name: `My target ${this.freeNumber()}`, at: [at.x, at.y, at.z], radiusMm });
    this.list.push(target);
    this.chosen = target.id;
    this.keep();
    this.change();
    return target;
  }

  /** Places a target for the moment, with a rule of its own, and makes it the one in force. point: mm, `box`. */
  addPassing(point: Vector3, name: string, rule: ReachRule): Target {
    const target = { id: `own-${++this.placed}`, name, position: point.clone(), radiusMm: rule.radiusMm, own: true, rule };
    this.list.push(target);
    this.chosen = target.id;
    this.change();
    return target;
  }

  /** Takes an own target away; those of the scene stay. */
  remove(id: string): void {
    const left = this.list.filter((target) => target.id !== id || !target.own);
    if (left.length === this.list.length) return;
    this.list = left;
    this.keep();
    this.change();
  }

  choose(id: string): void {
    if (this.chosen === id || !this.list.some((target) => target.id === id)) return;
    this.chosen = id;
    this.change();
  }

  /** Makes the next target (or by -1 the one before) the one in force, round and round. */
  step(by: number): void {
    const now = this.active;
    if (now === null) return;
    const count = this.list.length;
    this.chosen = this.list[(this.list.indexOf(now) + by + count) % count]!.id;
    this.change();
  }

  /** Calls `listener` after every change, until what is returned is called. */
  listen(listener: () => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  private own({ name, at, radiusMm }: Kept): Target {
    const position = new Vector3(...at).applyMatrix4(this.boxFromHeart);
    return { id: `own-${++this.placed}`, name, position, radiusMm, own: true };
  }

  private freeNumber(): number {
    for (let number = 1; ; number++) {
      if (!this.list.some(({ name }) => name === `My target ${number}`)) return number;
    }
  }

  private change(): void {
    this.version += 1;
    for (const listener of [...this.listeners]) listener();
  }

  private kept(): Kept[] {
    try {
      const found: unknown = JSON.parse(this.storage?.getItem(this.key) ?? "[]");
      return Array.isArray(found) ? found.filter(isKept).slice(0, MOST_OWN) : [];
    } catch {
      return []; // somebody else's text, or no storage
    }
  }

  private keep(): void {
    const kept = this.list.filter(({ own, rule }) => own && rule === undefined).map(({ name, position, radiusMm }): Kept => {
      const at = position.clone().applyMatrix4(this.heartFromBox);
      return { name, at: [at.x, at.y, at.z], radiusMm };
    });
    try {
      this.storage?.setItem(this.key, JSON.stringify(kept));
    } catch {
      // a full or forbidden storage: they hold for this visit
    }
  }
}

function fromScene(told: TargetDescription): Target {
  const name = told.label || told.name.replaceAll("_", " ");
  return { id: `scene-${told.name}`, name, position: new Vector3(...told.position_mm), radiusMm: told.radius_mm, own: false };
}

function isKept(value: unknown): value is Kept {
  const { name, at, radiusMm } = (value ?? {}) as Partial<Kept>;
  return typeof name === "string" && name.length <= 64 && Array.isArray(at) && at.length === 3
    && at.every((each) => Number.isFinite(each)) && Number.isFinite(radiusMm) && radiusMm! > 0 && radiusMm! < 100;
}
