/** The form that marks a trial invalid: the reason is asked, as it is kept with the trial. */

import { make } from "../../ui/dom";
import { button } from "./parts";

/** Returns the form, closed: a button that opens a field for the reason. onMark: returns whether it was granted. */
export function markForm(what: string, id: string, onMark: (reason: string) => Promise<boolean>): HTMLElement {
  const host = make("div", "mark");
  const form = make("form");
  const reason = make("input");
  const open = button("Mark invalid", () => toggle(true));
  const send = make("button", "", "Mark it");
  reason.name = "reason";
  reason.maxLength = 200;
  reason.id = id;
  reason.placeholder = "Why it must not count";
  reason.setAttribute("aria-label", `Why ${what} must not count`);
  send.type = "submit";
  form.append(reason, send, button("Cancel", () => toggle(false)));
  form.hidden = true;
  open.setAttribute("aria-expanded", "false");
  open.setAttribute("aria-controls", id);
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    void onMark(reason.value).then((done) => {
      if (done) toggle(false);
      else reason.focus();
    });
  });
  form.addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    toggle(false);
  });
  host.append(open, form);
  return host;

  function toggle(opened: boolean): void {
    form.hidden = !opened;
    open.hidden = opened;
    open.setAttribute("aria-expanded", String(opened));
    if (!opened) reason.value = "";
    (opened ? reason : open).focus();
  }
}
