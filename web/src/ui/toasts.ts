/** Short notes that go away by themselves. */

import type { EventMessage } from "../generated/messages";
import { byId, make } from "./dom";

const SHOWN_MS = 5000;
const MOST = 3;

/** Shows a note; the same one is not shown twice at a time. */
export function toast(text: string, level: "good" | "bad" = "good"): void {
  const host = byId("toasts");
  for (const shown of host.children) if (shown.textContent === text) return;
  const note = make("div", "toast", text);
  note.dataset["level"] = level;
  while (host.children.length >= MOST) host.firstElementChild!.remove();
  host.append(note);
  setTimeout(() => note.remove(), SHOWN_MS);
}

/** Shows an event's sentence where it has one. */
export function toastEvent(event: EventMessage): void {
  const { sentence } = event.payload ?? {};
  if (typeof sentence === "string") toast(sentence, /error|failed/.test(event.kind) ? "bad" : "good");
}
