/** Keys of the page: what each asks for. */

import type { Vector3 } from "../generated/messages";
import type { PlaneName } from "./geometry";
import { AXES } from "./geometry";

export type KeyAct =
  | { readonly act: "cursor"; readonly step: Vector3 }
  | { readonly act: "choose"; readonly number: number }
  | { readonly act: "zoom"; readonly by: -1 | 0 | 1 }
  | { readonly act: "look" | "place" | "add" | "remove" | "undo" | "redo" | "save" | "overlay" | "window" | "heart" };

export interface Keys {
  readonly key: string;
  readonly shiftKey: boolean;
  readonly ctrlKey: boolean;
  readonly metaKey: boolean;
  readonly altKey: boolean;
}

const FAR = 10;
const PLAIN: Record<string, KeyAct["act"] & ("look" | "remove" | "overlay" | "window" | "heart")> = {
  Escape: "look", Delete: "remove", Backspace: "remove", l: "overlay", w: "window", h: "heart",
};

/** Returns what a key asks for in a plane; null: nothing. */
export function keyAct(event: Keys, plane: PlaneName): KeyAct | null {
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (event.altKey) return null;
  if (event.ctrlKey || event.metaKey) {
    if (key === "z") return { act: event.shiftKey ? "redo" : "undo" };
    if (key === "y") return { act: "redo" };
    return key === "s" ? { act: "save" } : null;
  }
  const [right, down, through] = AXES[plane];
  const far = event.shiftKey ? FAR : 1;
  switch (key) {
    case "ArrowLeft": return move(right, -far);
    case "ArrowRight": return move(right, far);
    case "ArrowUp": return move(down, -far);
    case "ArrowDown": return move(down, far);
    case "PageUp": return move(through, -far);
    case "PageDown": return move(through, far);
    case "Enter": return { act: event.shiftKey ? "add" : "place" };
    case "+": case "=": return { act: "zoom", by: 1 };
    case "-": return { act: "zoom", by: -1 };
    case "0": return { act: "zoom", by: 0 };
  }
  if (/^[1-9]$/.test(key)) return { act: "choose", number: Number(key) };
  const plain = PLAIN[key];
  return plain === undefined ? null : { act: plain };
}

function move(axis: number, by: number): KeyAct {
  const step: [number, number, number] = [0, 0, 0];
  step[axis] = by;
  return { act: "cursor", step };
}
