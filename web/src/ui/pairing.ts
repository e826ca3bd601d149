/** The pairing form: how a viewer becomes an operator. */

import type { Commands } from "../link/commands";
import { byId, setText } from "./dom";

/** Makes the form `#pairing-form` work; `onPaired` is called once the server has taken the code. */
export function wirePairing(commands: Commands, onPaired: () => void): void {
  const field = byId<HTMLInputElement>("pairing-code");
  const trouble = byId("pairing-trouble");
  const pair = async (): Promise<void> => {
    const answer = await commands.ask("pair", { code: field.value.replaceAll(/\s/g, "") });
    trouble.hidden = answer.done;
    if (!answer.done) {
      setText(trouble, answer.sentence);
      field.select();
      return;
    }
    field.value = "";
    onPaired();
  };
  byId<HTMLFormElement>("pairing-form").addEventListener("submit", (event) => {
    event.preventDefault();
    void pair();
  });
}
