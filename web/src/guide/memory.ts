/** What this browser remembers of the guide. */

import type { Memory, Note } from "./guide";

const KEPT_AS = "cathxr.guide";
const STATES: readonly string[] = ["offered", "running", "left", "finished"];

/** Keeps notes in the page's storage, and for this visit where there is none. */
export class StoredMemory implements Memory {
  private readonly notes: Partial<Record<"page" | "headset", Note>> = {};

  constructor(private readonly storage: Storage | null) {
    try {
      const found = JSON.parse(storage?.getItem(KEPT_AS) ?? "{}") as Record<string, Partial<Note> | undefined> | null;
      for (const kind of ["page", "headset"] as const) {
        const { state, at } = found?.[kind] ?? {};
        if (state !== undefined && STATES.includes(state) && typeof at === "string") this.notes[kind] = { state, at };
      }
    } catch {
      // somebody else's text, or no storage: as on a first visit
    }
  }

  read(kind: "page" | "headset"): Note | null {
    return this.notes[kind] ?? null;
  }

  write(kind: "page" | "headset", note: Note): void {
    this.notes[kind] = note;
    try {
      this.storage?.setItem(KEPT_AS, JSON.stringify(this.notes));
    } catch {
      // a full or forbidden storage: it holds for this visit
    }
  }
}
