/** Slices from the server: asked for when they are looked at, kept while there is room, neighbours fetched ahead. */

import type { PlaneName } from "./geometry";

/** Enough for a few hundred slices of 512 x 512: scrolling back and forth asks for nothing. */
export const CACHE_BYTES = 192 * 1024 * 1024;
const AHEAD = 3;
const MOST_AT_ONCE = 2;
const AGAIN_MS = 1000;

/** Keeps what was used last, up to a number of bytes. */
export class Cache<V extends { readonly byteLength: number }> {
  private readonly kept = new Map<string, V>();
  private bytes = 0;

  constructor(private readonly most: number) {}

  get(key: string): V | undefined {
    const value = this.kept.get(key);
    if (value !== undefined) { // the newest stands last
      this.kept.delete(key);
      this.kept.set(key, value);
    }
    return value;
  }

  has(key: string): boolean {
    return this.kept.has(key);
  }

  put(key: string, value: V): void {
    const before = this.kept.get(key);
    if (before !== undefined) this.bytes -= before.byteLength;
    this.kept.delete(key);
    this.kept.set(key, value);
    this.bytes += value.byteLength;
    for (const [oldest, gone] of this.kept) {
      if (this.bytes <= this.most || oldest === key) break;
      this.kept.delete(oldest);
      this.bytes -= gone.byteLength;
    }
  }

  clear(): void {
    this.kept.clear();
    this.bytes = 0;
  }
}

interface Line {
  readonly wanted: number;
  readonly direction: number;
  readonly slices: number;
}

export interface LoaderHandlers {
  /** A slice has come; it may be the one that is wanted. */
  onSlice(plane: PlaneName): void;
  /** A slice could not be had; a phrase for a person, empty when all is well again. */
  onTrouble(phrase: string): void;
}

/** Loads the slices of one kind, `ct` or labels. The newest wish goes first; a wish that is no longer one is not asked. */
export class SliceLoader<V extends Int16Array | Uint8Array> {
  private readonly lines = new Map<PlaneName, Line>();
  private readonly asked = new Set<string>();
  private readonly cache: Cache<V>;
  private generation = 0;

  /** `read` gets a slice by its path below heart/: rejects where it cannot. */
  constructor(
    private readonly read: (path: string) => Promise<ArrayBuffer>,
    private readonly decode: (data: ArrayBuffer) => V,
    private readonly handlers: LoaderHandlers,
    private folder = "",
    bytes = CACHE_BYTES,
  ) {
    this.cache = new Cache<V>(bytes);
  }

  /** Says where the slices are now: "ct", or "labels/3"; empty: there are none. All that was kept is forgotten. */
  from(folder: string): void {
    if (folder === this.folder) return;
    this.folder = folder;
    this.forget();
  }

  forget(): void {
    this.generation += 1;
    this.cache.clear();
    this.asked.clear();
    for (const plane of [...this.lines.keys()]) this.next(plane);
  }

  /** Returns a slice where it is there; else it is loaded. */
  want(plane: PlaneName, index: number, slices: number): V | null {
    const before = this.lines.get(plane);
    if (before?.wanted !== index) {
      this.lines.set(plane, { wanted: index, slices, direction: before === undefined || index >= before.wanted ? 1 : -1 });
      this.next(plane);
    }
    return this.cache.get(key(plane, index)) ?? null;
  }

  private next(plane: PlaneName): void {
    const line = this.lines.get(plane);
    if (line === undefined || this.folder === "") return;
    const running = [...this.asked].filter((each) => each.startsWith(plane)).length;
    if (running >= MOST_AT_ONCE) return;
    for (const index of order(line)) {
      if (this.cache.has(key(plane, index)) || this.asked.has(key(plane, index))) continue;
      void this.load(plane, index);
      if (running + 1 < MOST_AT_ONCE && index === line.wanted) continue;
      return;
    }
  }

  private async load(plane: PlaneName, index: number): Promise<void> {
    const { generation } = this;
    const name = key(plane, index);
    this.asked.add(name);
    try {
      const data = await this.read(`${this.folder}/${name}.bin`);
      if (generation !== this.generation) return;
      this.cache.put(name, this.decode(data));
      this.asked.delete(name);
      this.handlers.onTrouble("");
      this.handlers.onSlice(plane);
    } catch {
      if (generation !== this.generation) return;
      this.asked.delete(name);
      if (this.lines.get(plane)?.wanted === index) this.handlers.onTrouble("this slice could not be loaded");
      setTimeout(() => this.next(plane), AGAIN_MS);
      return;
    }
    this.next(plane);
  }
}

/** Returns the slices of a plane by how soon they will be wanted. */
export function order({ wanted, direction, slices }: Line): number[] {
  const found = [wanted];
  for (let step = 1; step <= AHEAD; step += 1) found.push(wanted + direction * step);
  found.push(wanted - direction);
  return found.filter((index) => index >= 0 && index < slices);
}

function key(plane: PlaneName, index: number): string {
  return `${plane}/${index}`;
}
