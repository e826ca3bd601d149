/** Commands to the server: sent with an id, answered by `done` or by a refusal. */

import type { ClientMessage, EventMessage, Refusal } from "../generated/messages";

export type Answer =
  | { readonly done: true; readonly result: Record<string, unknown> }
  | { readonly done: false; readonly sentence: string };

/** How long an answer may take before the command counts as failed. */
export const ANSWER_WITHIN_MS = 4000;

export class Commands {
  private readonly waiting = new Map<string, (answer: Answer) => void>();
  private count = 0;

  constructor(private readonly transmit: (message: ClientMessage) => boolean) {}

  /** Sends a command and resolves with its answer; never rejects. */
  ask(name: string, args: Record<string, unknown> = {}): Promise<Answer> {
    const id = `page-${++this.count}`;
    return new Promise((resolve) => {
      const timer = setTimeout(() => this.settle(id, fail("The server did not answer.")), ANSWER_WITHIN_MS);
      this.waiting.set(id, (answer) => {
        clearTimeout(timer);
        resolve(answer);
      });
      if (!this.transmit({ type: "command", name, args, id })) this.settle(id, fail("There is no link to the server."));
    });
  }

  /** Takes an event; returns whether it was the answer to a command of this page. */
  takeEvent(event: EventMessage): boolean {
    if (event.kind !== "done" || typeof event.payload["id"] !== "string") return false;
    const result = event.payload["result"];
    return this.settle(event.payload["id"], {
      done: true,
      result: typeof result === "object" && result !== null ? (result as Record<string, unknown>) : {},
    });
  }

  /** Takes a refusal; returns whether it answers a command of this page. */
  takeRefusal(refusal: Refusal): boolean {
    return refusal.id !== null && this.settle(refusal.id, fail(refusal.sentence));
  }

  /** Fails everything that still waits: the link is gone. */
  abandon(): void {
    for (const id of [...this.waiting.keys()]) this.settle(id, fail("The link to the server broke."));
  }

  private settle(id: string, answer: Answer): boolean {
    const resolve = this.waiting.get(id);
    if (resolve === undefined) return false;
    this.waiting.delete(id);
    resolve(answer);
    return true;
  }
}

function fail(sentence: string): Answer {
  return { done: false, sentence };
}
