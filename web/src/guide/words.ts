/** The words of the help: one source for the page and for the headset. */

/** How something is done on a page. An empty text: not in this way. */
export interface PageWay {
  readonly what: string;
  readonly mouse: string;
  readonly touch: string;
  readonly keys: readonly string[];
}

export const PAGE_WAYS: readonly PageWay[] = [
  { what: "Turn the view", mouse: "drag", touch: "one finger", keys: [] },
  { what: "Shift the view", mouse: "right drag", touch: "two fingers", keys: [] },
  { what: "Closer, farther", mouse: "wheel", touch: "pinch", keys: [] },
  { what: "Oblique, top, front, along the catheter", mouse: "buttons below", touch: "buttons below", keys: ["1", "2", "3", "4"] },
  { what: "First view again", mouse: "Reset", touch: "Reset", keys: ["R"] },
  { what: "Hide or show the heart", mouse: "“All parts”", touch: "“All parts”", keys: ["H"] },
  { what: "Landmarks", mouse: "under “Heart”", touch: "tab “Scene”", keys: ["L"] },
  { what: "Camera picture large", mouse: "click it", touch: "tap it", keys: ["T", "F"] },
  { what: "Place a target", mouse: "double click on the heart", touch: "", keys: [] },
  { what: "Start a trial, answer a survey", mouse: "“Training”", touch: "tab “Training”", keys: [] },
  { what: "Record, stop", mouse: "Record", touch: "Record", keys: ["Space"] },
  { what: "Close what is open, end the guide", mouse: "×", touch: "×", keys: ["Esc"] },
  { what: "This help", mouse: "?", touch: "?", keys: ["?"] },
];

/** Steering of the twin. */
export const TWIN_WAYS: readonly { readonly what: string; readonly keys: readonly string[]; readonly real: string }[] = [
  { what: "Push in, pull back", keys: ["W", "S"], real: "push or pull the shaft" },
  { what: "Roll left, right", keys: ["A", "D"], real: "turn the whole handle" },
  { what: "Bend forwards, backwards (anterior, posterior)", keys: ["↑", "↓"], real: "steering knob" },
  { what: "Bend left, right", keys: ["←", "→"], real: "second steering knob" },
  { what: "Four times finer", keys: ["Shift"], real: "" },
];

/** How something is done in a headset. */
export interface HeadsetWay {
  readonly what: string;
  readonly controllers: string;
  readonly hands: string;
}

export const HEADSET_WAYS: readonly HeadsetWay[] = [
  { what: "take the heart, move and turn it", controllers: "Hold the grip", hands: "Pinch in the air" },
  { what: "enlarge, shrink", controllers: "Both grips, pull apart", hands: "Pinch with both hands, pull apart" },
  { what: "press, drag a slider", controllers: "Point, trigger", hands: "Point and pinch, or touch" },
  { what: "menu", controllers: "B or Y", hands: "Left palm to your face" },
  { what: "start a trial", controllers: "Menu, tab Training", hands: "Menu, tab Training" },
  { what: "this help", controllers: "A or X", hands: "Menu, tab Help" },
  { what: "heart back before you", controllers: "Press the thumbstick", hands: "Menu, tab Place" },
];

/** What colours mean, the most important first. */
export const COLOURS: readonly { readonly colour: string; readonly name: string; readonly means: string }[] = [
  { colour: "#45d39a", name: "Green dot", means: "the catheter is tracked" },
  { colour: "#ffb454", name: "Amber, see-through tube", means: "predicted: not seen for a moment" },
  { colour: "#ff6b6b", name: "Red dot", means: "lost, or the link is gone" },
  { colour: "#4dff9e", name: "Green stripe, arrow", means: "the side on which the ultrasound looks" },
  { colour: "#ff3d78", name: "Pink on the tube", means: "it is in the virtual wall" },
  { colour: "#ffd166", name: "Yellow ball", means: "a target; blue: you are in it; green: reached" },
];

/** Only of the page. */
export const PAGE_COLOURS: typeof COLOURS = [
  { colour: "#5aa9ff", name: "Blue line in a camera's picture", means: "the catheter as it was measured; the white circle is its tip" },
  { colour: "#5d7186", name: "Grey line on the floor", means: "the catheter's shadow: where it is above" },
];

/** What to do when something is wrong. `brief`: for a headset, where there is little room. */
export const TROUBLES: readonly { readonly when: string; readonly then: string; readonly brief: string }[] = [
  {
    when: "No catheter is seen (lost)",
    then: "Push it in until both cameras see its tip. Take everything else out of the box, and see that the back-light is on. Tracking goes on by itself.",
    brief: "push it in until both cameras see it",
  },
  {
    when: "The tube is amber (coasting)",
    then: "One camera does not see it, and its place is guessed for a moment. Hold still, or pull back a little.",
    brief: "hold still, or pull back a little",
  },
  {
    when: "The link is lost",
    then: "The page tries again by itself; nothing has to be loaded anew. If it lasts: is the computer with cathxr running, and in the same network?",
    brief: "wait, it tries again by itself",
  },
  {
    when: "Roll is unknown (no stripe)",
    then: "After a start nobody knows how the handle was turned. A note on the picture says what to do: confirm it, or set roll zero.",
    brief: "confirm it, or set roll zero, on the page",
  },
  {
    when: "You have lost the heart",
    then: "Press R or Reset. In a headset press the thumbstick, or “Put it before me” in the menu under Place.",
    brief: "menu, Place, “Put it before me”",
  },
  {
    when: "A setting is grey",
    then: "An exercise holds it, or the person whom you follow. Point at it: the reason is said.",
    brief: "point at it, the reason is said below",
  },
];

/** Returns the help's lines for a headset's plate: first what the hands do, then what colours mean, then what is wrong. */
export function headsetLines(bare: boolean): string[] {
  return [
    ...HEADSET_WAYS.map(({ what, controllers, hands }) => `${bare ? hands : controllers}: ${what}`),
    ...COLOURS.map(({ name, means }) => `${name}: ${means}`),
    ...TROUBLES.map(({ when, brief }) => `${when.replace(/ \(.*\)/, "")}: ${brief}`),
  ];
}

/** What is written beside a controller: its parts, and what they do. */
export const CONTROLLER_PARTS: readonly (readonly [string, string])[] = [
  ["Trigger", "press"],
  ["Grip", "hold the heart"],
  ["Stick, pressed", "heart back"],
];

/** The buttons have other names on each side. */
export const BUTTON_NAMES = { left: { menu: "Y", help: "X" }, right: { menu: "B", help: "A" } } as const;

export const HAND_PARTS: readonly (readonly [string, string])[] = [
  ["Point and pinch", "press"],
  ["Pinch in the air", "hold the heart"],
];
