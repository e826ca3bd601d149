/** Colours that are seen on any picture, for markers that are named by theirs. */

const SEEN: Record<string, string> = {
  red: "#ff5d5d",
  green: "#3fe08a",
  blue: "#5aa2ff",
  yellow: "#ffe14d",
};

/** Returns the colour a marker's ring is drawn in; white for one without a known colour. */
export function ringColour(colour: string): string {
  return SEEN[colour.toLowerCase()] ?? "#ffffff";
}
