/** What the menu's help says: short lines, by what the viewer holds. */

const COMMON: readonly string[] = [
  "The tube is the real catheter: push, pull, roll it",
  "Green stripe and arrow: where the beam looks",
];

export const CONTROLLER_HELP: readonly string[] = [
  "Grip squeezed: hold the heart, move and turn it",
  "Both grips: pull apart to enlarge",
  "Point, pull the trigger: press, drag a slider",
  "B or Y: this menu · A or X: this help",
  "Thumbstick pressed: heart back before you",
  ...COMMON,
];

export const HAND_HELP: readonly string[] = [
  "Pinch in the air: hold the heart, move and turn it",
  "Pinch with both hands: pull apart to enlarge",
  "Point and pinch, or touch: press, drag a slider",
  "Left palm to your face: the menu button",
  "Tab Place: heart back before you, or inside it",
  ...COMMON,
];
