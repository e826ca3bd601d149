/** The guide's steps: what is said, where to look, and what has to be done. Data; to change the guide, change this. */

import type { Mover, Place, Situation } from "./situation";
import { inHeadset } from "./situation";
import type { Task } from "./trial";

/** Where to look: something of the page, of the scene, or of what a headset's hands hold. */
export type Anchor =
  | { readonly element: string }
  | { readonly scene: "catheter" | "inlet" | "tip" | "heart" | "target" }
  | { readonly plate: "menu" | "picture" };

/** What a variant of the words is for; what is not given does not matter. */
interface When {
  readonly place?: readonly Place[];
  readonly mover?: readonly Mover[];
  readonly roll?: boolean;
}

interface Said extends When {
  readonly text: string;
}

export interface Step {
  readonly id: string;
  readonly title: string;
  /** The first that fits is said. */
  readonly say: readonly Said[];
  /** Said when it is done. */
  readonly praise: string;
  readonly task: (now: Situation) => Task;
  readonly look: (now: Situation) => Anchor | null;
  /** Whether it makes sense; a step that does not is left out. */
  readonly fits: (now: Situation) => boolean;
  /** In a headset the twin is steered by buttons on the guide itself: which. */
  readonly steers?: "push" | "roll" | "flex";
}

const PAGE: readonly Place[] = ["mouse", "touch"];
const moves = ({ mover }: Situation): boolean => mover !== "nobody";
/** The slider on a page; the catheter itself where there is none. */
const slider = (id: string, otherwise: Anchor) => (now: Situation): Anchor =>
  now.mover === "twin" && !inHeadset(now.place) ? { element: id } : otherwise;

export const STEPS: readonly Step[] = [
  {
    id: "take",
    title: "Take hold of the catheter",
    say: [
      { mover: ["twin"], place: ["mouse"], text: "The pale tube in the glass heart is a simulated catheter, and now it moves by itself. Take it over: hold the key W, or drag a slider under “Steer the twin”." },
      { mover: ["twin"], place: ["touch"], text: "The pale tube in the glass heart is a simulated catheter, and now it moves by itself. Take it over: open “Steer” and drag a slider." },
      { mover: ["twin"], text: "The pale tube in the glass heart before you is a simulated catheter, and now it moves by itself. Take it over: press and hold “Push in” below." },
      { mover: ["hand"], place: PAGE, text: "Take the catheter's handle and push the catheter through the inlet of the box, until it appears here. What you see is the catheter in your hand, at this moment." },
      { mover: ["hand"], text: "Take the real catheter's handle and push it into the box, until the tube before you moves with it. It is the catheter in your hand." },
      { text: "The pale tube in the glass heart is the catheter. Somebody else moves it; you can look at it from all sides. To steer it yourself, enter the pairing code under “Viewing only”." },
    ],
    praise: "You have it.",
    task: (now) => (moves(now) ? { kind: "taken" } : { kind: "read" }),
    look: slider("#steering", { scene: "catheter" }),
    fits: () => true,
    steers: "push",
  },
  {
    id: "insert",
    title: "Push in, pull back",
    say: [
      { mover: ["twin"], place: ["mouse"], text: "Hold W to push the catheter in and S to pull it back (with Shift: finer). Move it by 10 mm. The rings on the tube are 10 mm apart." },
      { mover: ["twin"], place: ["touch"], text: "Open “Steer” and drag “Insertion” by 10 mm. The rings on the tube are 10 mm apart." },
      { mover: ["twin"], text: "Hold “Push in” or “Pull back” until the catheter has moved by 10 mm. The rings on the tube are 10 mm apart." },
      { text: "Push the catheter in or pull it back by 10 mm, slowly. The rings on the tube are 10 mm apart." },
    ],
    praise: "That is advancing and withdrawing.",
    task: () => ({ kind: "inserted", mm: 10 }),
    look: slider("#slider-insertion_mm", { scene: "tip" }),
    fits: moves,
    steers: "push",
  },
  {
    id: "roll",
    title: "Roll it",
    say: [
      { mover: ["twin"], place: ["mouse"], text: "Hold D or A to roll the catheter about its own axis, by 45°. The green stripe turns with it: it marks the side on which the ultrasound looks out." },
      { mover: ["twin"], place: ["touch"], text: "Drag “Roll” by 45° (under “Steer”). The green stripe turns with it: it marks the side on which the ultrasound looks out." },
      { mover: ["twin"], text: "Hold one of the two buttons and roll the catheter about its own axis, by 45°. The green stripe marks the side on which the ultrasound looks out." },
      { text: "Turn the whole handle about its own axis, by 45°. The green stripe turns with it: it marks the side on which the ultrasound looks out." },
    ],
    praise: "The stripe shows where you look.",
    task: () => ({ kind: "rolled", deg: 45 }),
    look: slider("#slider-roll_deg", { scene: "tip" }),
    fits: (now) => moves(now) && now.roll,
    steers: "roll",
  },
  {
    id: "flex",
    title: "Bend the tip",
    say: [
      { mover: ["twin"], place: ["mouse"], text: "Press the arrow keys: ↑ ↓ bend the tip forwards and backwards (anterior, posterior), ← → to the left and right. Bend it by 15°." },
      { mover: ["twin"], place: ["touch"], text: "Drag “Anterior” or “Left” (under “Steer”): they bend the tip forwards and backwards, and to the sides. Bend it by 15°." },
      { mover: ["twin"], text: "Hold one of the four buttons until the tip has bent by 15°: forwards (anterior), backwards (posterior), left or right." },
      { text: "Turn the steering knob of the handle, and keep the handle itself still: the tip bends. Bend it by 15°." },
    ],
    praise: "Pushing, rolling, bending: that is all a catheter does.",
    task: () => ({ kind: "flexed", deg: 15 }),
    look: slider("#slider-anterior_deg", { scene: "tip" }),
    fits: moves,
    steers: "flex",
  },
  {
    id: "turn",
    title: "Look from another side",
    say: [
      { place: ["mouse"], text: "Drag in the picture with the left mouse button: the view turns. R or “Reset” brings the first view back." },
      { place: ["touch"], text: "Drag in the picture with one finger: the view turns. “Reset” brings the first view back." },
      { place: ["controllers"], text: "Squeeze the grip button under your middle finger, and hold: now the heart is in your hand. Carry it by 10 cm. To bring it back, press the thumbstick." },
      { place: ["hands"], text: "Pinch thumb and index finger in the air, and hold: now the heart is in your hand. Carry it by 10 cm. It follows and turns with your hand." },
    ],
    praise: "Go round it whenever you lose your bearings.",
    task: ({ place }) => (inHeadset(place) ? { kind: "moved", cm: 10 } : { kind: "turned", deg: 25 }),
    look: () => ({ scene: "heart" }),
    fits: ({ space, free }) => space && free,
  },
  {
    id: "size",
    title: "Come closer",
    say: [
      { place: ["mouse"], text: "Turn the mouse wheel: you come closer or step back." },
      { place: ["touch"], text: "Pinch in the picture with two fingers: you come closer or step back." },
      { place: ["controllers"], text: "Squeeze both grip buttons, and pull your hands apart: the heart grows. Push them together: it shrinks." },
      { place: ["hands"], text: "Pinch with both hands in the air, and pull them apart: the heart grows. Move them together: it shrinks." },
    ],
    praise: "“Reset” on a page, “Put it before me” in a headset, undo all of it.",
    task: () => ({ kind: "sized", percent: 30 }),
    look: () => ({ scene: "heart" }),
    fits: ({ space, free }) => space && free,
  },
  {
    id: "settings",
    title: "Change what you see",
    say: [
      { place: ["mouse"], text: "Under “Scene” and “Heart” on the left is everything that can be shown or hidden. Change one thing: for instance make the heart more opaque, or switch the landmarks on." },
      { place: ["touch"], text: "Open “Scene” below the picture: there is everything that can be shown or hidden. Change one thing, for instance switch the landmarks on." },
      { place: ["controllers"], text: "Press B or Y for the menu. Point at something, pull the trigger under your index finger: change one thing. For instance “Landmarks” under “Heart”. B or Y closes the menu." },
      { place: ["hands"], text: "Turn your left palm to your face and press “Menu” with the other hand. Point and pinch, or touch: change one thing. For instance “Landmarks” under “Heart”." },
    ],
    praise: "You can always change it back.",
    task: ({ place }) => ({ kind: "setting", menu: inHeadset(place) }),
    look: ({ place }) => (inHeadset(place) ? { plate: "menu" } : { element: "#scene" }),
    fits: ({ settings }) => settings,
  },
  {
    id: "picture",
    title: "See with ultrasound",
    say: [
      { place: ["touch"], text: "The catheter carries an ultrasound probe (ICE: an echo picture from inside the heart). Under “Scene”, switch “Ultrasound (ICE)” on and off. On: an echo picture of the slice beside the tip. Off: what a tiny camera at the tip would see." },
      { place: PAGE, roll: true, text: "The catheter carries an ultrasound probe (ICE: an echo picture from inside the heart). Switch “Ultrasound (ICE)” on and off. On: the fan at the tip is the slice that the picture shows; it turns when you roll. Off: you see what a tiny camera at the tip would see." },
      { place: PAGE, text: "The catheter carries an ultrasound probe (ICE: an echo picture from inside the heart). Switch “Ultrasound (ICE)” on and off. On: an echo picture of the slice beside the tip. Off: what a tiny camera at the tip would see." },
      { text: "The catheter carries an ultrasound probe (ICE: an echo picture from inside the heart). In the menu under “View”, switch “Ultrasound (ICE)”. On: the fan at the tip is the slice that the picture shows. Off: you see what a tiny camera at the tip would see." },
    ],
    praise: "Roll, and the slice sweeps through the heart.",
    task: () => ({ kind: "pictures", seconds: 1.5 }),
    look: ({ place }) => (inHeadset(place) ? { plate: "picture" } : { element: "[data-setting=ice]" }),
    fits: ({ heart, ice }) => heart && ice,
  },
  {
    id: "target",
    title: "Reach a target",
    say: [
      { mover: ["twin"], place: ["mouse"], text: "The yellow ball in the ring is a target. Bring the tip into it with W and S, and stay for a second. The dashed line shows the way; the numbers say how far it is and how far off the tip points." },
      { mover: ["twin"], place: ["touch"], text: "The yellow ball in the ring is a target. Bring the tip into it with “Insertion”, and stay for a second. The dashed line shows the way; the numbers say how far it is and how far off the tip points." },
      { mover: ["twin"], text: "The yellow ball in the ring is a target. Bring the tip into it with the buttons below, and stay for a second. The dashed line shows the way, the numbers how far it is and how far off the tip points." },
      { text: "The yellow ball in the ring is a target. Push in or pull back until the tip is in it, and stay for a second. The dashed line shows the way; the numbers say how far it is and how far off the tip points." },
    ],
    praise: "Reached! The heart's own targets want the tip to point at them as well.",
    task: () => ({ kind: "reached" }),
    look: () => ({ scene: "target" }),
    fits: (now) => moves(now) && now.heart && now.space && now.targets,
    steers: "push",
  },
  {
    id: "end",
    title: "That is all",
    say: [
      { place: ["mouse"], text: "Help is always one press away: the ? at the top, or the key ?. There you can take this guide again, too." },
      { place: ["touch"], text: "Help is always one press away: the ? at the top. There you can take this guide again, too." },
      { place: ["controllers"], text: "Help is always one press away: A or X. You can take this guide again from there, too." },
      { place: ["hands"], text: "Help is in the menu, under “Help”. You can take this guide again from there, too." },
    ],
    praise: "",
    task: () => ({ kind: "read" }),
    look: ({ place }) => (inHeadset(place) ? null : { element: "#help-open" }),
    fits: () => true,
  },
];

/** Returns what a step says in a situation. */
export function wordsOf({ say }: Step, now: Situation): string {
  const found = say.find(({ place, mover, roll }) =>
    (place?.includes(now.place) ?? true) && (mover?.includes(now.mover) ?? true) && (roll === undefined || roll === now.roll));
  return found?.text ?? "";
}
