/** What single keys and the view's buttons do. */

import type { Preset, Presets } from "../scene/presets";
import { PRESETS } from "../scene/presets";
import { byId } from "./dom";

export interface Actions {
  readonly presets: Presets;
  toggleHeart(): void;
  toggleLandmarks(): void;
  toggleRecording(): void;
  /** Enlarges a camera's picture, or makes it small again. */
  togglePicture(camera: string): void;
  /** Closes what is open; returns whether anything was. */
  closeAll(): boolean;
  /** Goes on where something waits for that; returns whether anything did. */
  goOn(): boolean;
}

/** Returns the meaning of keys: true when one meant something. */
export function makeStrokes(actions: Actions): (key: string) => boolean {
  const meanings: Record<string, () => void> = {
    r: () => actions.presets.go("iso", performance.now()),
    h: actions.toggleHeart,
    l: actions.toggleLandmarks,
    t: () => actions.togglePicture("top"),
    f: () => actions.togglePicture("front"),
    " ": actions.toggleRecording,
    "?": openHelp,
  };
  PRESETS.forEach((preset, index) => {
    meanings[String(index + 1)] = () => actions.presets.go(preset, performance.now());
  });
  return (key) => {
    if (key === "Escape") return actions.closeAll();
    if (key === "Enter") return actions.goOn();
    const meaning = meanings[key.toLowerCase()];
    meaning?.();
    return meaning !== undefined;
  };
}

/** Connects the view's buttons and the help. */
export function wireViews(presets: Presets): void {
  const buttons = [...document.querySelectorAll<HTMLButtonElement>("[data-preset]")];
  for (const button of buttons) {
    button.addEventListener("click", () => presets.go(button.dataset["preset"] as Preset, performance.now()));
  }
  byId("reset-view").addEventListener("click", () => presets.go("iso", performance.now()));
  presets.onChange = (current) => {
    for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset["preset"] === current));
  };
  byId("help-open").addEventListener("click", openHelp);
  const help = byId<HTMLDialogElement>("help");
  help.addEventListener("click", (event) => {
    if (event.target === help) help.close(); // the backdrop
  });
}

function openHelp(): void {
  byId<HTMLDialogElement>("help").showModal();
}
