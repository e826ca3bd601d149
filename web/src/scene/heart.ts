/** The heart: loaded from the server's GLB and placed by the registration. */

import { Group, Mesh, PropertyBinding } from "three";
import type { BufferGeometry, Object3D } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { HeartDescription } from "../generated/messages";
import { boxFromGltf } from "../maths/registration";
import type { Settings } from "../settings";
import { HeartPart } from "./heart_part";

/** The name that the heart's file gives the material of its caps. */
const CAPS_MATERIAL = "caps";

export class Heart {
  readonly group = new Group();
  /** The inner walls, opaque, in `box` mm: they hang in a scene of their own, for the view from the tip. */
  readonly inside = new Group();
  parts: HeartPart[] = [];
  /** Counts the hearts that were loaded or taken away. */
  version = 0;

  constructor(private readonly settings: Settings) {
    this.group.name = "heart";
    this.inside.name = "inner walls";
    this.group.matrixAutoUpdate = this.inside.matrixAutoUpdate = false;
  }

  /** Loads a heart in place of the present one. Throws Error when the file is missing or is not what was described. */
  async load(description: HeartDescription, sceneUrl: string): Promise<void> {
    const file = await new GLTFLoader().loadAsync(new URL(description.glb, sceneUrl).href);
    this.clear();
    boxFromGltf(this.group.matrix, description.registration);
    this.inside.matrix.copy(this.group.matrix);
    this.group.matrixWorldNeedsUpdate = this.inside.matrixWorldNeedsUpdate = true;
    file.scene.updateMatrixWorld(true);
    for (const told of description.parts) {
      const node = file.scene.getObjectByName(PropertyBinding.sanitizeNodeName(told.node));
      if (node === undefined) throw new Error(`The heart's file has no part named ${told.node}.`);
      const part = new HeartPart(told, this.settings);
      this.adopt(part, node);
      part.measure(this.group.matrix);
      this.inside.add(part.inside);
      this.parts.push(part);
    }
    this.version += 1;
  }

  /** Takes the heart out of the scene and off the graphics card. */
  clear(): void {
    for (const part of this.parts) part.dispose();
    this.group.clear();
    this.inside.clear();
    this.parts = [];
    this.version += 1;
  }

  private adopt(part: HeartPart, node: Object3D): void {
    node.traverse((found) => {
      if (!(found instanceof Mesh) || isCaps(found)) return;
      const geometry = found.geometry as BufferGeometry;
      if (geometry.getAttribute("normal") === undefined) geometry.computeVertexNormals();
      part.add(geometry, found.matrixWorld, this.group);
    });
  }
}

/** Whether a mesh closes a valve's plane or a vessel's cut: a catheter passes there, so it is no wall and not drawn. */
export function isCaps(mesh: Mesh): boolean {
  return !Array.isArray(mesh.material) && mesh.material.name === CAPS_MATERIAL;
}
