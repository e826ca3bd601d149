/** The heart's volumes for the simulated pictures: loaded once for the ultrasound and the X-ray image alike. */

import type { SceneDescription } from "../generated/messages";
import { loadAcoustic, loadLabels } from "../link/heart_files";
import type { Feature } from "../stage/feature";
import type { AcousticVolume, LabelVolume } from "../ultrasound";

export class HeartVolumes implements Feature {
  acoustic: AcousticVolume | null = null;
  labels: LabelVolume | null = null;
  /** Name and colour of each part, for a legend. */
  parts: readonly (readonly [name: string, colour: string])[] = [];
  /** Why there is no acoustic volume, in words; empty: there is one. */
  trouble = "There is no scene yet.";
  /** Counts up with every change: whoever shows a volume compares it with what it has shown. */
  version = 0;
  private asked = 0;

  constructor(private readonly wanted = true) {}

  async describe(scene: SceneDescription, sceneUrl: string): Promise<void> {
    const asked = ++this.asked;
    const none = !this.wanted ? "The heart is turned off (heart=0)." : scene.heart === null ? "There is no heart in this scene." : "";
    this.clear(none || "Loading the heart …");
    if (none !== "" || scene.heart === null) return;
    this.parts = scene.heart.parts.map(({ name, colour }) => [readable(name), colour] as const);
    const [acoustic, labels] = await Promise.all([
      loadAcoustic(scene, sceneUrl).catch(reasonOf), loadLabels(scene, sceneUrl).catch(() => null),
    ]);
    if (asked !== this.asked) return;
    this.labels = labels;
    if (acoustic !== null && typeof acoustic !== "string") {
      this.acoustic = acoustic;
      this.trouble = "";
    } else {
      this.trouble = acoustic === null
        ? "This heart has no acoustic volume: build it again with cathxr heart build."
        : acoustic;
    }
    this.version += 1;
  }

  update(): boolean {
    return false;
  }

  dispose(): void {
    this.clear("");
  }

  private clear(trouble: string): void {
    this.acoustic?.dispose();
    this.labels?.dispose();
    this.acoustic = this.labels = null;
    this.trouble = trouble;
    this.version += 1;
  }
}

function reasonOf(error: unknown): string {
  return error instanceof Error ? error.message : "The acoustic volume could not be loaded.";
}

/** Returns a part's name as people write it: `left_ventricle` is the left ventricle. */
function readable(name: string): string {
  const words = name.replaceAll("_", " ");
  return words.charAt(0).toUpperCase() + words.slice(1);
}
