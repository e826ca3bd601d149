/** What the guide knows of where somebody is, and what it is told each frame. No page, no drawing. */

/** On a page with a mouse and keys or with fingers; in a headset with controllers or with bare hands. */
export type Place = "mouse" | "touch" | "controllers" | "hands";

/** Who moves the catheter: this person steers the twin, a hand holds the real one, or nobody here can. */
export type Mover = "twin" | "hand" | "nobody";

/** What does not change from frame to frame. */
export interface Situation {
  readonly place: Place;
  readonly mover: Mover;
  /** Whether an encoder tells the roll. */
  readonly roll: boolean;
  readonly heart: boolean;
  /** Whether the scene in space is shown, not the flat pictures. */
  readonly space: boolean;
  /** Whether the view or the heart may be moved: not while somebody else is followed. */
  readonly free: boolean;
  /** Whether a person may change some setting, the ultrasound, the targets. */
  readonly settings: boolean;
  readonly ice: boolean;
  readonly targets: boolean;
}

/** One frame. The same object each time, written anew. */
export interface Measured {
  nowMs: number;
  dtS: number;
  /** Whether the catheter is seen now: tracked, neither predicted nor an old picture. */
  known: boolean;
  /** Whether it is this person who moves it: the real one always is, the twin once its script has been stopped. */
  steered: boolean;
  /** Arc length in the box, mm. */
  insertedMm: number;
  /** Unwrapped, degrees; null without a valid roll. */
  rollDeg: number | null;
  /** Bend between the flexible end's base and the tip, degrees, and its direction as seen along the base, degrees. */
  bendDeg: number;
  bendTowardsDeg: number;
  menuOpen: boolean;
  /** Counts a person's changes of settings. */
  changes: number;
  /** Whether the ultrasound is shown; else the view from the tip. */
  ice: boolean;
  /** Whether the view (on a page) or the heart (in a headset) is being moved by hand, not by itself. */
  handMoved: boolean;
  /** On a page: azimuth and height of the camera about what it looks at, degrees. In a headset: unused. */
  azimuthDeg: number;
  heightDeg: number;
  /** In a headset: where the heart is, cm in the room. */
  readonly heartCm: Float64Array;
  /** On a page: one over the camera's distance; in a headset: how many times life size. Positive. */
  size: number;
  /** From the tip to the target in force, mm; null without one. */
  targetMm: number | null;
  targetReached: boolean;
  /** Whether the tip is within the target and only has to stay. */
  targetWithin: boolean;
}

/** Returns a frame in which nothing happens. */
export function still(): Measured {
  return {
    nowMs: 0, dtS: 0, known: false, steered: false, insertedMm: 0, rollDeg: null, bendDeg: 0, bendTowardsDeg: 0, menuOpen: false,
    changes: 0, ice: false, handMoved: false, azimuthDeg: 0, heightDeg: 0, heartCm: new Float64Array(3), size: 1,
    targetMm: null, targetReached: false, targetWithin: false,
  };
}

export function inHeadset(place: Place): boolean {
  return place === "controllers" || place === "hands";
}
