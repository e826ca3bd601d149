/** What a person sets about the scene: the same on the desktop page, in the headset's menu, and for who follows them. */

/** The immersive scene, or the flat pictures of a cath lab. */
export type Mode = "3d" | "2d";
/** What cuts the heart open: nothing, a plane in the hand (on a desktop: across the view), or the beam's plane. */
export type Cut = "off" | "hand" | "beam";

/** A pair of views that is used often; the arms' own angles are in `arms`. */
export type Biplane = "ap" | "oblique" | "own";

export interface PartSettings {
  readonly visible: boolean;
  /** 0 to 1. */
  readonly opacity: number;
}

/** Angles of an X-ray arm, degrees: left anterior oblique and cranial positive, as DICOM's positioner angles have it. */
export interface ArmAngles {
  readonly laoDeg: number;
  readonly cranialDeg: number;
}

export interface SceneSettings {
  readonly mode: Mode;
  /** The ultrasound beam, its sphere and its picture; off: the view from the tip instead. */
  readonly ice: boolean;
  readonly sectorDeg: number;
  readonly depthMm: number;
  readonly gainDb: number;
  readonly frequencyMHz: number;
  readonly frozen: boolean;
  /** Colour over the ultrasound picture by what the plane cuts, 0 (off) to 1. */
  readonly teaching: number;
  readonly iceDistalLeft: boolean;
  /** Of the whole heart, 0 to 1; `parts` says what differs, by the part's name. */
  readonly heartOpacity: number;
  readonly parts: Readonly<Record<string, PartSettings>>;
  readonly cut: Cut;
  readonly targets: boolean;
  readonly landmarks: boolean;
  readonly wallContact: boolean;
  readonly arms: readonly [ArmAngles, ArmAngles];
  readonly biplane: Biplane;
  readonly hud: boolean;
  readonly sound: boolean;
}

export type SettingKey = keyof SceneSettings;
export type Change = Partial<SceneSettings>;

export const DEFAULTS: SceneSettings = {
  mode: "3d",
  ice: false,
  sectorDeg: 90,
  depthMm: 90,
  gainDb: 0,
  frequencyMHz: 7.5,
  frozen: false,
  teaching: 0,
  iceDistalLeft: true,
  heartOpacity: 0.16,
  parts: {},
  cut: "off",
  targets: false,
  landmarks: false,
  wallContact: true,
  arms: [{ laoDeg: 0, cranialDeg: 0 }, { laoDeg: 90, cranialDeg: 0 }],
  biplane: "ap",
  hud: true,
  sound: true,
};

const LIMITS: Readonly<Partial<Record<SettingKey, readonly [number, number]>>> = {
  sectorDeg: [30, 120],
  depthMm: [30, 160],
  gainDb: [-30, 30],
  frequencyMHz: [4, 12],
  teaching: [0, 1],
  heartOpacity: [0, 1],
};
const CHOICES: Readonly<Partial<Record<SettingKey, readonly string[]>>> = {
  mode: ["3d", "2d"],
  cut: ["off", "hand", "beam"],
  biplane: ["ap", "oblique", "own"],
};
/** What is not taken over from an earlier visit. */
const FLEETING: ReadonlySet<SettingKey> = new Set(["frozen", "mode", "cut"]);

/** Returns what of a change, from another client or an earlier visit, can be believed: known keys, right types, in range. */
export function cleaned(change: unknown): Change {
  if (typeof change !== "object" || change === null) return {};
  const given = change as Record<string, unknown>;
  const result: Record<string, unknown> = {};
  for (const key of Object.keys(DEFAULTS) as SettingKey[]) {
    const value = acceptable(key, given[key]);
    if (value !== undefined) result[key] = value;
  }
  return result as Change;
}

function acceptable(key: SettingKey, value: unknown): unknown {
  if (value === undefined || value === null) return undefined;
  if (key === "parts") return partsOf(value);
  if (key === "arms") return armsOf(value);
  if (typeof value !== typeof DEFAULTS[key]) return undefined;
  const choices = CHOICES[key];
  if (choices !== undefined) return choices.includes(value as string) ? value : undefined;
  if (typeof value !== "number") return value;
  const [low, high] = LIMITS[key] ?? [-Infinity, Infinity];
  return Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : undefined;
}

function partsOf(value: unknown): Record<string, PartSettings> | undefined {
  if (typeof value !== "object" || value === null) return undefined;
  const parts: Record<string, PartSettings> = {};
  for (const [name, each] of Object.entries(value).slice(0, 64)) {
    const { visible, opacity } = (each ?? {}) as Partial<PartSettings>;
    if (typeof visible !== "boolean" || typeof opacity !== "number" || !Number.isFinite(opacity)) continue;
    parts[name] = { visible, opacity: Math.min(1, Math.max(0, opacity)) };
  }
  return parts;
}

function armsOf(value: unknown): readonly [ArmAngles, ArmAngles] | undefined {
  if (!Array.isArray(value) || value.length !== 2) return undefined;
  const arms = value.map((each) => {
    const { laoDeg, cranialDeg } = (each ?? {}) as Partial<ArmAngles>;
    if (!Number.isFinite(laoDeg) || !Number.isFinite(cranialDeg)) return null;
    return { laoDeg: Math.min(180, Math.max(-180, laoDeg!)), cranialDeg: Math.min(90, Math.max(-90, cranialDeg!)) };
  });
  return arms[0] && arms[1] ? [arms[0], arms[1]] : undefined;
}

/** What a training session holds fast, and the sentence that says so. */
export interface Lock {
  readonly values: Change;
  readonly sentence: string;
}

export type Listener = (now: SceneSettings, before: SceneSettings) => void;

/**
 * Holds the settings. Every change, wherever from, goes through `set`, so that everybody sees the same. Over a person's
 * own settings lie those borrowed from whom they follow, and over both what is locked.
 */
export class SettingsStore {
  private own: SceneSettings;
  private lent: Lock | null = null;
  private lockedBy: Lock | null = null;
  private current: SceneSettings;
  private readonly listeners = new Set<Listener>();

  /** storage: where the settings of an earlier visit are, null: nowhere. */
  constructor(private readonly storage: Storage | null = null, private readonly name = "cathxr.scene") {
    this.own = this.current = { ...DEFAULTS, ...this.earlier() };
  }

  get value(): SceneSettings {
    return this.current;
  }

  get lock(): Lock | null {
    return this.lockedBy;
  }

  /** Whether another person's settings are shown. */
  get borrowed(): boolean {
    return this.lent !== null;
  }

  /** Whether a setting cannot be changed now: it is locked, or another person's settings are borrowed. */
  locked(key: SettingKey): boolean {
    return this.lent !== null || (this.lockedBy !== null && key in this.lockedBy.values);
  }

  /** Why a setting cannot be changed now, as a sentence; empty when it can. */
  why(key: SettingKey): string {
    if (this.lockedBy !== null && key in this.lockedBy.values) return this.lockedBy.sentence;
    return this.lent?.sentence ?? "";
  }

  /** Changes some settings, but for what is held fast; values out of range are brought into it. */
  set(change: Change): void {
    const wanted = cleaned(change);
    const free = Object.fromEntries(Object.entries(wanted).filter(([key]) => !this.locked(key as SettingKey))) as Change;
    // The whole heart's opacity goes for parts that had their own too: else its slider would leave them as they are.
    const whole = free.heartOpacity !== undefined && wanted.parts === undefined && !this.locked("parts");
    this.own = { ...this.own, ...free, ...(whole ? { parts: withOpacity(this.own.parts, free.heartOpacity!) } : {}) };
    if (this.refresh()) this.keep();
  }

  /** Shows or hides one part of the heart, or gives it an opacity of its own. */
  setPart(name: string, change: Partial<PartSettings>): void {
    const now = this.part(name);
    this.set({ parts: { ...this.current.parts, [name]: { ...now, ...change } } });
  }

  part(name: string): PartSettings {
    return this.current.parts[name] ?? { visible: true, opacity: this.current.heartOpacity };
  }

  /** Holds some settings fast; null lets go of them. */
  hold(lock: Lock | null): void {
    this.lockedBy = lock === null ? null : { values: cleaned(lock.values), sentence: lock.sentence };
    if (!this.refresh()) this.tell(this.current);
  }

  /** Shows another person's settings in place of one's own, which cannot be changed meanwhile and are kept. */
  borrow(change: Change, sentence: string): void {
    const began = this.lent === null;
    this.lent = { values: cleaned(change), sentence };
    if (!this.refresh() && began) this.tell(this.current);
  }

  /** Shows one's own settings again. */
  giveBack(): void {
    if (this.lent === null) return;
    this.lent = null;
    if (!this.refresh()) this.tell(this.current);
  }

  /** Calls `listener` after every change, of what is held fast too, until what is returned is called. */
  listen(listener: Listener): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  /** Works out what holds now; returns whether that is something else than before, which the listeners then know. */
  private refresh(): boolean {
    const next: SceneSettings = { ...this.own, ...this.lent?.values, ...this.lockedBy?.values };
    if ((Object.keys(next) as SettingKey[]).every((key) => same(next[key], this.current[key]))) return false;
    const before = this.current;
    this.current = next;
    this.tell(before);
    return true;
  }

  private tell(before: SceneSettings): void {
    for (const listener of [...this.listeners]) listener(this.current, before);
  }

  private earlier(): Change {
    try {
      const change = cleaned(JSON.parse(this.storage?.getItem(this.name) ?? "{}"));
      return Object.fromEntries(Object.entries(change).filter(([key]) => !FLEETING.has(key as SettingKey)));
    } catch {
      return {}; // somebody else's text, or no storage: the defaults do
    }
  }

  private keep(): void {
    try {
      this.storage?.setItem(this.name, JSON.stringify(this.own));
    } catch {
      // a full or forbidden storage: the settings hold for this visit
    }
  }
}

function withOpacity(parts: SceneSettings["parts"], opacity: number): SceneSettings["parts"] {
  return Object.fromEntries(Object.entries(parts).map(([name, part]) => [name, { ...part, opacity }]));
}

function same(a: unknown, b: unknown): boolean {
  return a === b || (typeof a === "object" && JSON.stringify(a) === JSON.stringify(b));
}
