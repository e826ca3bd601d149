/** Brings the heart in, and says what is wrong when it cannot be. */

import type { HeartDescription } from "../generated/messages";
import type { Stagecraft } from "../scene/stagecraft";
import type { Settings } from "../settings";
import type { SettingsStore } from "../stage/settings";
import { byId, setText } from "./dom";
import { PartList } from "./parts";

export class HeartLoader {
  private readonly list: PartList;

  constructor(
    private readonly stagecraft: Stagecraft,
    private readonly settings: Settings,
    private readonly store: SettingsStore,
  ) {
    this.list = new PartList(store);
  }

  /** Loads a scene's heart, or takes the present one away. Never rejects: the scene is of use without it. */
  async show(heart: HeartDescription | null, sceneUrl: string): Promise<void> {
    setText(byId("attribution"), heart === null ? "" : `Heart: ${heart.attribution}`);
    if (heart === null || !this.settings.heart) {
      this.stagecraft.heart.clear();
      this.list.explain(heart === null ? "There is no heart in this scene." : "The heart is turned off (heart=0).");
      return;
    }
    this.list.explain("Loading…");
    try {
      await this.stagecraft.heart.load(heart, sceneUrl);
      this.list.show(heart);
    } catch (error) {
      this.stagecraft.heart.clear();
      this.list.explain(`The heart could not be loaded: ${error instanceof Error ? error.message : "unknown reason"}`);
    }
    this.stagecraft.view.touch();
  }

  toggleLandmarks(): void {
    this.store.set({ landmarks: !this.store.value.landmarks });
  }

  toggle(): void {
    this.list.toggleAll();
  }
}
