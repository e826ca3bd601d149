/** A run shown again in the scene: fetched from the server, played, stopped. What draws it and what steers it look here. */

import type { RunPath } from "../generated/messages";
import { RunPlayer } from "./run_player";

export class Replay {
  player: RunPlayer | null = null;
  /** Counts runs that were loaded or put away. */
  version = 0;
  private asked = 0;

  /** onTrouble: a sentence on why it cannot be shown. */
  constructor(private readonly onChange: () => void, private readonly onTrouble: (sentence: string) => void) {}

  get shown(): boolean {
    return this.player !== null;
  }

  /** Fetches a run from a path of the server and plays it. */
  async load(path: string): Promise<boolean> {
    const asked = ++this.asked;
    try {
      const response = await fetch(new URL(path.replace(/^\//, ""), document.baseURI).href, { cache: "no-store" });
      if (!response.ok) throw new Error(response.status === 404 ? "the server does not have it" : `status ${response.status}`);
      const run = (await response.json()) as RunPath;
      if (asked !== this.asked) return false;
      if (run.t.length < 2) throw new Error("it holds no positions");
      this.show(run);
      return true;
    } catch (error) {
      if (asked === this.asked) this.onTrouble(`The run cannot be shown: ${error instanceof Error ? error.message : "no answer"}.`);
      return false;
    }
  }

  show(run: RunPath): void {
    this.player = new RunPlayer(run);
    this.player.play();
    this.change();
  }

  /** Back to what is live. */
  stop(): void {
    this.asked += 1;
    if (this.player === null) return;
    this.player = null;
    this.change();
  }

  toggle(): void {
    const { player } = this;
    if (player === null) return;
    if (player.playing) player.pause();
    else player.play();
    this.onChange();
  }

  seek(timeS: number): void {
    this.player?.pause();
    this.player?.seek(timeS);
    this.onChange();
  }

  private change(): void {
    this.version += 1;
    this.onChange();
  }
}
