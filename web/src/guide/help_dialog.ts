/** Fills the page's help from the words, and lets the guide be taken up from there. */

import { byId, make, setText } from "../ui/dom";
import type { Guide } from "./guide";
import { COLOURS, HEADSET_WAYS, PAGE_COLOURS, PAGE_WAYS, TROUBLES, TWIN_WAYS } from "./words";

/** Writes the help, and connects its buttons. */
export function wireHelp(guide: Guide): void {
  const dialog = byId<HTMLDialogElement>("help");
  byId("help-sheet").prepend(
    section("On this page", ways()),
    section("Steering the catheter", steering()),
    section("In a headset", headset()),
    section("What the colours mean", colours()),
    section("When something is wrong", troubles()),
  );
  const anew = byId<HTMLButtonElement>("guide-anew");
  const goOn = byId<HTMLButtonElement>("guide-go-on");
  const begin = (fromStart: boolean) => () => {
    dialog.close();
    guide.start(fromStart);
  };
  anew.addEventListener("click", begin(true));
  goOn.addEventListener("click", begin(false));
  // The dialog is opened in more than one place: what it says is brought up to date whenever it is.
  new MutationObserver(() => {
    if (!dialog.open) return;
    const at = guide.resumesAt;
    goOn.hidden = at === null;
    setText(goOn, `Go on at step ${at ?? 1}`);
    setText(anew, at === null ? "Start the guide" : "From the beginning");
    dialog.scrollTop = 0;
  }).observe(dialog, { attributes: true, attributeFilter: ["open"] });
}

function section(title: string, content: HTMLElement): HTMLElement {
  const made = make("section");
  made.append(make("h3", "", title), content);
  return made;
}

function ways(): HTMLElement {
  const rows = PAGE_WAYS.map(({ what, mouse, touch, keys }) => row(what, [mouse || "–", touch || "–"], keys));
  return table(["", "Mouse", "Touch", "Keys"], rows);
}

function steering(): HTMLElement {
  const rows = TWIN_WAYS.map(({ what, keys, real }) => row(what, [real || "–"], keys));
  return table(["", "Real catheter", "Twin"], rows);
}

function headset(): HTMLElement {
  const made = table(["", "Controllers", "Bare hands"], HEADSET_WAYS.map(({ what, controllers, hands }) => row(capital(what), [controllers, hands], null)));
  made.classList.add("hands");
  return made;
}

function table(head: readonly string[], rows: readonly HTMLElement[]): HTMLTableElement {
  const made = make("table");
  const top = make("thead");
  const titles = make("tr");
  for (const each of head) {
    const cell = make("th", "", each);
    cell.scope = "col";
    titles.append(cell);
  }
  top.append(titles);
  const body = make("tbody");
  body.append(...rows);
  made.append(top, body);
  return made;
}

function row(what: string, texts: readonly string[], keys: readonly string[] | null): HTMLElement {
  const made = make("tr");
  const name = make("th", "", what);
  name.scope = "row";
  made.append(name, ...texts.map((text) => make("td", "", text)));
  if (keys === null) return made;
  const cell = make("td");
  for (const key of keys) cell.append(make("kbd", "", key), " ");
  made.append(cell);
  return made;
}

function colours(): HTMLElement {
  const made = make("dl", "help-colours");
  for (const { colour, name, means } of [...COLOURS, ...PAGE_COLOURS]) {
    const patch = make("i");
    patch.style.background = colour;
    const text = make("dd");
    text.append(make("b", "", name), `: ${means}`);
    made.append(patch, text);
  }
  made.append(make("dd", "", "The rings on the tube are 10 mm apart, counted from the tip; the tube has the catheter's true diameter."));
  return made;
}

function troubles(): HTMLElement {
  const made = make("dl", "help-trouble");
  for (const { when, then } of TROUBLES) made.append(make("dt", "", when), make("dd", "", then));
  return made;
}

function capital(text: string): string {
  return text.charAt(0).toUpperCase() + text.slice(1);
}
