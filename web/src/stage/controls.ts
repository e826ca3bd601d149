/** The settings as a person meets them: one list for the page's panel and for the menu in the scene. */

import type { SceneSettings, SettingKey } from "./settings";

interface Common {
  readonly key: SettingKey;
  readonly label: string;
  readonly help: string;
  readonly group: "View" | "Ultrasound" | "Heart" | "Training";
  /** Whether it has a meaning now. */
  readonly shown?: (now: SceneSettings) => boolean;
}

export interface ToggleControl extends Common {
  readonly kind: "toggle";
}

export interface ChoiceControl extends Common {
  readonly kind: "choice";
  readonly choices: readonly { readonly value: string; readonly label: string }[];
}

export interface SliderControl extends Common {
  readonly kind: "slider";
  readonly low: number;
  readonly high: number;
  readonly step: number;
  readonly unit: string;
}

export type Control = ToggleControl | ChoiceControl | SliderControl;

const flat = (now: SceneSettings): boolean => now.mode === "2d";
const withIce = (now: SceneSettings): boolean => now.ice;

export const CONTROLS: readonly Control[] = [
  {
    key: "mode", kind: "choice", label: "Picture", group: "View", help: "The heart in space, or the flat pictures of a cath lab",
    choices: [{ value: "3d", label: "3D" }, { value: "2d", label: "2D" }],
  },
  {
    key: "biplane", kind: "choice", label: "X-ray", group: "View", help: "The two arms: AP and lateral, RAO 30 and LAO 45, or as turned by hand", shown: flat,
    choices: [{ value: "ap", label: "AP, lat" }, { value: "oblique", label: "RAO, LAO" }, { value: "own", label: "own" }],
  },
  { key: "ice", kind: "toggle", label: "Ultrasound (ICE)", group: "View", help: "Beam and ultrasound picture; off: the view from the tip" },
  { key: "hud", kind: "toggle", label: "Numbers", group: "View", help: "Tip, targets and delay beside the catheter" },
  { key: "sound", kind: "toggle", label: "Sound", group: "View", help: "A tone when a target is reached" },
  { key: "depthMm", kind: "slider", label: "Depth", group: "Ultrasound", low: 30, high: 160, step: 10, unit: "mm", help: "How far the beam reaches", shown: withIce },
  { key: "gainDb", kind: "slider", label: "Gain", group: "Ultrasound", low: -30, high: 30, step: 1, unit: "dB", help: "Brightness of the echoes", shown: withIce },
  { key: "sectorDeg", kind: "slider", label: "Sector", group: "Ultrasound", low: 30, high: 120, step: 5, unit: "°", help: "How wide the beam is", shown: withIce },
  { key: "frequencyMHz", kind: "slider", label: "Frequency", group: "Ultrasound", low: 4, high: 12, step: 0.5, unit: "MHz", help: "Higher: finer, and less deep", shown: withIce },
  { key: "frozen", kind: "toggle", label: "Freeze", group: "Ultrasound", help: "Hold the picture", shown: withIce },
  { key: "teaching", kind: "slider", label: "Colour", group: "Ultrasound", low: 0, high: 1, step: 0.1, unit: "", help: "Colours what the plane cuts", shown: withIce },
  { key: "iceDistalLeft", kind: "toggle", label: "Tip on the left", group: "Ultrasound", help: "Which side of the picture is distal", shown: withIce },
  { key: "heartOpacity", kind: "slider", label: "Opacity", group: "Heart", low: 0, high: 1, step: 0.02, unit: "", help: "Of the whole heart" },
  {
    key: "cut", kind: "choice", label: "Cut open", group: "Heart", help: "A plane that takes away what is in front of it",
    choices: [{ value: "off", label: "off" }, { value: "hand", label: "by hand" }, { value: "beam", label: "by the beam" }],
  },
  { key: "landmarks", kind: "toggle", label: "Landmarks", group: "Heart", help: "Openings and landmarks by name" },
  { key: "wallContact", kind: "toggle", label: "Wall contact", group: "Heart", help: "Where the catheter meets the virtual wall" },
  { key: "targets", kind: "toggle", label: "Targets", group: "Training", help: "Places to reach, with distance and angle" },
];
