/** Quality switches in the page's address, so that a slow machine or a test can turn the cost down. */

export interface Settings {
  /** Multisampling of the 3D view (`aa=0` turns it off). */
  readonly antialias: boolean;
  /** `standard` (lit, two passes for translucent parts) or `lambert` (cheaper, one pass). */
  readonly material: "standard" | "lambert";
  /** Pixels per CSS pixel; null: the screen's own (at most 2), lowered by itself while frames are slow. */
  readonly pixelRatio: number | null;
  /** Camera pictures per second at most; 0 turns them off. */
  readonly picturesHz: number;
  /** Whether the heart is loaded at all (`heart=0`: not). */
  readonly heart: boolean;
}

/** Returns the settings that a query string such as `?aa=0&mat=lambert&dpr=1&pictures=0&heart=0` asks for. */
export function settingsFrom(query: string): Settings {
  const given = new URLSearchParams(query);
  return {
    antialias: given.get("aa") !== "0",
    material: given.get("mat") === "lambert" ? "lambert" : "standard",
    pixelRatio: numberWithin(given.get("dpr"), 0.25, 4),
    picturesHz: numberWithin(given.get("pictures"), 0, 120) ?? 30,
    heart: given.get("heart") !== "0",
  };
}

function numberWithin(text: string | null, low: number, high: number): number | null {
  if (text === null || text.trim() === "") return null;
  const value = Number(text);
  return Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : null;
}
