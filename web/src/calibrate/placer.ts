/** Sends where a person puts markers: newest wins for each marker, one command on its way at a time. */

import type { Vector2 } from "../generated/messages";
import type { Answer } from "../link/commands";
import type { MarkerKey } from "./marker_model";

export interface PlacerHandlers {
  ask(name: string, args: Record<string, unknown>): Promise<Answer>;
  /** The server has answered to the last place of this marker. */
  onSettled(key: MarkerKey, answer: Answer): void;
}

export interface Wish {
  readonly camera: string;
  readonly marker: string;
  readonly pixel: Vector2;
  /** This very place is meant: the server does not move it to the middle of the spot that lies there. */
  readonly exact: boolean;
}

export class Placer {
  private readonly wishes = new Map<MarkerKey, Wish>();
  private busy = false;
  private sending: MarkerKey | null = null;

  constructor(private readonly handlers: PlacerHandlers) {}

  place(key: MarkerKey, wish: Wish): void {
    this.wishes.set(key, wish);
    if (!this.busy) void this.flush();
  }

  /** Forgets a wish that has not been sent. */
  forget(key: MarkerKey): void {
    this.wishes.delete(key);
  }

  /** Returns whether a newer place of this marker waits to be sent. */
  waits(key: MarkerKey): boolean {
    return this.wishes.has(key) || this.sending === key;
  }

  private async flush(): Promise<void> {
    this.busy = true;
    for (let next = first(this.wishes); next !== null; next = first(this.wishes)) {
      const [key, wish] = next;
      this.wishes.delete(key);
      this.sending = key;
      const answer = await this.handlers.ask("calibration_place", { ...wish });
      this.sending = null;
      if (!this.wishes.has(key)) this.handlers.onSettled(key, answer);
    }
    this.busy = false;
  }
}

function first<K, V>(map: Map<K, V>): [K, V] | null {
  for (const entry of map) return entry;
  return null;
}
