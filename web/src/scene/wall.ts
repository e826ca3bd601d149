/** Where the catheter is in the virtual wall: coloured on the tube, and told in figures. */

import { Matrix4, Vector3 } from "three";
import type { LandmarkDescription, SceneDescription } from "../generated/messages";
import type { RawLabels } from "../link/heart_files";
import { loadRawLabels } from "../link/heart_files";
import type { DistanceField } from "../maths/distance_field";
import { bloodVoxels, distanceAt, UNKNOWN } from "../maths/distance_field";
import type { Mouth, WallContact } from "../maths/wall_contact";
import { openEnds, wallContact } from "../maths/wall_contact";
import { MOST_POINTS } from "../motion/snapshot";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import { ctFromBox } from "../maths/registration";
import type { Blood } from "../xr/standpoint";
import type { WallReadout } from "./target_readout";

/** Less than this is within what labels and registration can tell. */
const SEEN_MM = 0.05;

export class Wall implements Feature {
  private field: DistanceField | null = null;
  private ends: Mouth[] = [];
  private readonly ctFromBox = new Matrix4();
  private scale = 1;
  private radiusMm = 1.5;
  private worker: Worker | null = null;
  private asked = 0;
  private readonly contact: WallContact = { depths: new Float32Array(MOST_POINTS), count: 0, deepestMm: 0 };
  private tinted = false;
  private known: WallReadout["state"] = "none";

  constructor(private readonly stage: Stage) {}

  /** Fetches the heart's labels; until the distances are known nothing is said about the wall. */
  async describe(scene: SceneDescription, sceneUrl: string): Promise<void> {
    const asked = ++this.asked;
    const { settings } = this.stage;
    this.field = null;
    this.stage.blood = null;
    this.stop();
    this.radiusMm = scene.catheter_diameter_mm / 2;
    const { heart } = scene;
    this.known = "none";
    if (heart === null || !settings.heart) return;
    ctFromBox(this.ctFromBox, heart.registration);
    this.scale = Math.cbrt(Math.abs(this.ctFromBox.determinant()));
    try {
      const raw = await loadRawLabels(scene, sceneUrl);
      if (asked !== this.asked || raw === null) return;
      this.known = "working";
      const voxels = bloodVoxels(raw.bytes, raw.size, raw.ctFromVoxel, raw.blood);
      this.worker = new Worker(new URL("./wall_worker.ts", import.meta.url), { type: "module" });
      this.worker.addEventListener("message", (event: MessageEvent<DistanceField>) => this.take(event.data, heart.landmarks, raw));
      this.worker.addEventListener("error", () => (this.known = "none"));
      this.worker.postMessage(voxels, [voxels.blood.buffer]);
    } catch {
      this.known = "none"; // the readout says so; the rest of the scene is of use without it
    }
  }

  update(frame: Frame): boolean {
    const { store, readout, catheter, tip } = this.stage;
    const { wall } = readout;
    const on = store.value.wallContact && this.field !== null && tip.valid && frame.track !== null;
    wall.state = store.value.wallContact ? this.known : "off";
    wall.count = 0;
    wall.depthMm = 0;
    if (!on) return this.clear();
    const { points, count } = frame.track!;
    wallContact(this.contact, this.field!, this.ends, points, count, this.ctFromBox.elements, this.scale, this.radiusMm);
    wall.count = this.contact.count;
    wall.depthMm = this.contact.deepestMm;
    if (this.contact.deepestMm < SEEN_MM) return this.clear();
    this.tinted = true;
    return catheter.tint(this.contact.depths, count);
  }

  dispose(): void {
    this.asked += 1;
    this.stop();
  }

  private clear(): boolean {
    if (!this.tinted) return false;
    this.tinted = false;
    return this.stage.catheter.tint(null, 0);
  }

  private take(field: DistanceField, landmarks: readonly LandmarkDescription[], labels: RawLabels): void {
    this.field = field;
    this.stage.blood = bloodOf(field, labels, this.ctFromBox, this.scale);
    this.ends = openEnds(field, mouths(landmarks));
    this.known = "ready";
    this.stop();
    this.stage.view.touch();
  }

  private stop(): void {
    this.worker?.terminate();
    this.worker = null;
  }
}

function mouths(landmarks: readonly LandmarkDescription[]): Mouth[] {
  return landmarks.flatMap(({ kind, position_ct: at, normal_ct: out, diameter_mm: across }): Mouth[] =>
    kind === "opening" && out !== null ? [{ at, out, radiusMm: (across ?? 10) / 2 }] : []);
}

/** What is known of the blood, asked in `box`. scale: mm of `ct` for one of `box`. */
function bloodOf(field: DistanceField, labels: RawLabels, ctFromBox: Matrix4, scale: number): Blood {
  const voxelFromBox = new Matrix4().fromArray([...labels.ctFromVoxel]).transpose().invert().multiply(ctFromBox);
  const [ni, nj, nk] = labels.size;
  const at = new Vector3();
  return {
    clearanceMm: (point) => {
      at.copy(point).applyMatrix4(ctFromBox);
      const mm = distanceAt(field, at.x, at.y, at.z);
      return mm === UNKNOWN ? mm : mm / scale;
    },
    chamberAt: (point) => {
      const { x, y, z } = at.copy(point).applyMatrix4(voxelFromBox).round();
      if (x < 0 || y < 0 || z < 0 || x >= ni || y >= nj || z >= nk) return 0;
      const label = labels.bytes[(z * nj + y) * ni + x]!;
      return labels.blood.has(label) ? label : 0;
    },
  };
}
