/** The buttons at the side's end: what may be done now, and below them why something may not. */

import type { Answer } from "../link/commands";
import { byId, make, setText } from "../ui/dom";
import { toast } from "../ui/toasts";
import type { Offer } from "./buttons";
import { keyed } from "./keyed";

export class Actions {
  private readonly host = byId("actions");
  private readonly why = byId("why");
  private readonly dialog = byId<HTMLDialogElement>("confirm");
  private offers: readonly Offer[] = [];
  private asked: Offer | null = null;
  private busy = false;

  /** `onDone` hears of every command that was carried out. */
  constructor(
    private readonly ask: (name: string, args: Record<string, unknown>) => Promise<Answer>,
    private readonly onDone: (command: string, result: Record<string, unknown>) => void,
  ) {
    this.dialog.addEventListener("close", () => {
      const { asked } = this;
      this.asked = null;
      if (asked !== null && this.dialog.returnValue === "yes") void this.send(asked.command);
    });
  }

  show(offers: readonly Offer[]): void {
    this.offers = offers;
    keyed(this.host, offers, (each) => each.command, (each) => {
      const button = make("button");
      button.type = "button";
      button.addEventListener("click", () => this.press(each.command));
      return button;
    }, (button, each) => {
      setText(button, each.label);
      button.className = each.kind;
      button.disabled = this.busy || each.why !== "";
      button.title = each.why;
      if (each.why === "") button.removeAttribute("aria-describedby");
      else button.setAttribute("aria-describedby", "why");
    });
    const why = [...new Set(offers.map((each) => each.why).filter((each) => each !== ""))];
    setText(this.why, why.join(" "));
  }

  /** Presses a button from elsewhere, for example with a key; nothing happens where it cannot be pressed. */
  press(command: string): void {
    const offer = this.offers.find((each) => each.command === command);
    if (offer === undefined || offer.why !== "" || this.busy) return;
    if (offer.confirm === "") {
      void this.send(command);
      return;
    }
    this.asked = offer;
    setText(byId("confirm-text"), offer.confirm);
    this.dialog.returnValue = "";
    this.dialog.showModal();
  }

  private async send(command: string): Promise<void> {
    this.busy = true;
    this.show(this.offers);
    const answer = await this.ask(command, {});
    this.busy = false;
    this.show(this.offers);
    if (answer.done) this.onDone(command, answer.result);
    else toast(answer.sentence, "bad");
  }
}
