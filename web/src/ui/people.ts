/** The panel that lists who else is connected, and the strip that says whom this page follows. */

import type { People } from "../follow/people";
import { byId, make, setText } from "./dom";

export class PeoplePanel {
  private readonly list = byId("people-list");
  private readonly strip = byId("following");
  private shown = "";

  constructor(private readonly people: People) {
    byId("following-stop").addEventListener("click", () => people.stop());
  }

  show(): void {
    const { others, self, followed, awaited, guideStep } = this.people;
    byId("people").hidden = others.length === 0;
    this.strip.hidden = followed === null && awaited === null;
    setText(byId("following-text"), followed !== null ? `Following ${followed.name}${guideStep === "" ? "" : ` · guide: ${guideStep}`}` : awaited !== null ? `Waiting for ${awaited} to come back` : "");
    const key = JSON.stringify([others, self?.name, followed?.id]);
    if (key === this.shown) return;
    this.shown = key;
    const had = document.activeElement instanceof HTMLElement ? document.activeElement.dataset["client"] : undefined;
    const rows = others.map(({ id, name, role }) => {
      const item = make("li", "person");
      const button = make("button", "", followed?.id === id ? "Stop" : "Follow");
      button.type = "button";
      button.dataset["client"] = id;
      button.setAttribute("aria-pressed", String(followed?.id === id));
      button.setAttribute("aria-label", followed?.id === id ? `Stop following ${name}` : `Follow ${name}: see what they see`);
      button.addEventListener("click", () => (this.people.followed?.id === id ? this.people.stop() : this.people.follow(id)));
      item.append(make("span", "", name), make("span", "faint", role), button);
      return item;
    });
    const me = make("li", "person self");
    if (self !== null) me.append(make("span", "faint", `${self.name}: this page`));
    this.list.replaceChildren(...rows, ...(self === null ? [] : [me]));
    if (had !== undefined) this.list.querySelector<HTMLElement>(`[data-client="${CSS.escape(had)}"]`)?.focus();
  }
}
