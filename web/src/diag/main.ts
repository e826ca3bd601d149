/** Starts the page that measures a device. */

import "../styles/base.css";
import "../styles/shell.css";
import "../styles/diag.css";
import type { DiagReport } from "../generated/messages";
import { linkAddress } from "../link/address";
import { pageStorage } from "../stage/storage";
import { byId, make, setText } from "../ui/dom";
import { lastHeadsetFrames } from "./headset_log";
import { Probe } from "./probe";
import type { Card } from "./words";
import { cardsOf, verdict } from "./words";

const again = byId<HTMLButtonElement>("again");
const save = byId<HTMLButtonElement>("save");
const saved = byId("saved");
const progress = byId<HTMLProgressElement>("progress");
let report: DiagReport | null = null;

async function measure(): Promise<void> {
  again.disabled = save.disabled = true;
  tell("", "good");
  setText(byId("verdict"), "Measuring for ten seconds: leave this page in view.");
  progress.hidden = false;
  const probe = new Probe(linkAddress(document.baseURI));
  report = await probe.measure(lastHeadsetFrames(pageStorage()), (share) => (progress.value = share));
  progress.hidden = true;
  setText(byId("verdict"), verdict(report));
  byId("cards").replaceChildren(...cardsOf(report).map(cardElement));
  again.disabled = save.disabled = false;
}

async function keep(): Promise<void> {
  if (report === null) return;
  save.disabled = true;
  try {
    const response = await fetch(new URL("diag", document.baseURI), {
      method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(report),
    });
    const answer = (await response.json()) as { file?: string; error?: string };
    if (answer.file === undefined) throw new Error(answer.error ?? `status ${response.status}`);
    tell(`Saved as ${answer.file} in the folder diag beside the recordings.`, "good");
  } catch (error) {
    tell(`Not saved: ${error instanceof Error ? error.message : "the server does not answer"}`, "bad");
    save.disabled = false;
  }
}

function tell(sentence: string, level: "good" | "bad"): void {
  setText(saved, sentence);
  saved.dataset["level"] = level;
}

function cardElement({ title, figures }: Card): HTMLElement {
  const card = make("section", "card");
  const list = make("dl");
  for (const { name, value, level, more } of figures) {
    const row = make("div");
    const shown = make("dd", "", value);
    shown.dataset["level"] = level;
    if (more !== "") shown.append(make("small", "", more));
    row.append(make("dt", "", name), shown);
    list.append(row);
  }
  card.append(make("h2", "", title), list);
  return card;
}

again.addEventListener("click", () => void measure());
save.addEventListener("click", () => void keep());
void measure();
