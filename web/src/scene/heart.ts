/** The heart: loaded from the server's GLB, placed by the registration, seen through. */

import {
  BackSide,
  Color,
  FrontSide,
  Group,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  MeshStandardMaterial,
  PropertyBinding,
  Quaternion,
  Vector3,
} from "three";
import type { BufferGeometry, Material, Object3D } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import type { HeartDescription, PartDescription, RegistrationDescription } from "../generated/messages";
import type { Settings } from "../settings";

export const DEFAULT_OPACITY = 0.16;
/** The name that the heart's file gives the material of its caps. */
const CAPS_MATERIAL = "caps";
const BACK_ORDER = 10;
const FRONT_ORDER = 20;

export class HeartPart {
  opacity = DEFAULT_OPACITY;
  visible = true;

  constructor(
    readonly description: PartDescription,
    private readonly meshes: readonly Mesh[],
  ) {
    this.apply();
  }

  /** Hides the part, or shows it with an opacity from 0 to 1. */
  show(visible: boolean, opacity: number): void {
    this.visible = visible;
    this.opacity = opacity;
    this.apply();
  }

  private apply(): void {
    const opaque = this.opacity > 0.985;
    for (const mesh of this.meshes) {
      const material = mesh.material as Material;
      mesh.visible = this.visible && this.opacity > 0.01 && (!opaque || material.side === FrontSide);
      material.opacity = this.opacity;
      material.depthWrite = opaque;
    }
  }
}

export class Heart {
  readonly group = new Group();
  parts: HeartPart[] = [];

  constructor(private readonly settings: Settings) {
    this.group.name = "heart";
    this.group.matrixAutoUpdate = false;
  }

  /** Loads a heart in place of the present one. Throws Error when the file is missing or is not what was described. */
  async load(description: HeartDescription, sceneUrl: string): Promise<void> {
    const file = await new GLTFLoader().loadAsync(new URL(description.glb, sceneUrl).href);
    this.clear();
    boxFromGltf(this.group.matrix, description.registration);
    this.group.matrixWorldNeedsUpdate = true;
    file.scene.updateMatrixWorld(true);
    for (const part of description.parts) {
      const node = file.scene.getObjectByName(PropertyBinding.sanitizeNodeName(part.node));
      if (node === undefined) throw new Error(`The heart's file has no part named ${part.node}.`);
      this.parts.push(new HeartPart(part, this.adopt(node, part.colour)));
    }
  }

  /** Takes the heart out of the scene and off the graphics card. */
  clear(): void {
    for (const mesh of this.group.children as Mesh<BufferGeometry, Material>[]) {
      mesh.geometry.dispose();
      mesh.material.dispose();
    }
    this.group.clear();
    this.parts = [];
  }

  /** Makes the drawn meshes of a node: the far faces first, then the near ones, so that a see-through part looks solid. */
  private adopt(node: Object3D, colour: string): Mesh[] {
    const made: Mesh[] = [];
    node.traverse((found) => {
      if (!(found instanceof Mesh) || isCaps(found)) return;
      const geometry = found.geometry as BufferGeometry;
      if (geometry.getAttribute("normal") === undefined) geometry.computeVertexNormals();
      const sides = this.settings.material === "lambert" ? [FrontSide] as const : [BackSide, FrontSide] as const;
      for (const side of sides) {
        const mesh = new Mesh(geometry, this.makeMaterial(colour, side));
        mesh.matrixAutoUpdate = false;
        mesh.matrix.copy(found.matrixWorld);
        mesh.renderOrder = side === BackSide ? BACK_ORDER : FRONT_ORDER;
        this.group.add(mesh);
        made.push(mesh);
      }
    });
    return made;
  }

  private makeMaterial(colour: string, side: typeof FrontSide | typeof BackSide): Material {
    const common = { color: new Color(colour), side, transparent: true, opacity: DEFAULT_OPACITY, depthWrite: false };
    const material = this.settings.material === "lambert"
      ? new MeshLambertMaterial(common)
      : new MeshStandardMaterial({ ...common, roughness: 0.55, metalness: 0 });
    // Walls seen edge-on are longer ways through tissue: more opaque there, clearer where one looks straight through.
    material.onBeforeCompile = (shader) => {
      shader.fragmentShader = shader.fragmentShader.replace(
        "#include <opaque_fragment>",
        `float facing = abs(dot(normalize(normal), normalize(vViewPosition)));
        diffuseColor.a = mix(1.0 - pow(1.0 - min(diffuseColor.a, 0.999), 1.0 / max(facing, 0.16)), 1.0, step(0.985, diffuseColor.a));
        #include <opaque_fragment>`,
      );
    };
    return material;
  }
}

/** Whether a mesh closes a valve's plane or a vessel's cut: a catheter passes there, so it is no wall and not drawn. */
export function isCaps(mesh: Mesh): boolean {
  return !Array.isArray(mesh.material) && mesh.material.name === CAPS_MATERIAL;
}

/** Writes the transform from glTF's metres (x, z, -y of `ct`) to mm in `box`. */
export function boxFromGltf(out: Matrix4, registration: RegistrationDescription): Matrix4 {
  const { rotation_wxyz, translation_mm } = registration.ct_from_box;
  const { scale, linear } = registration;
  if (linear != null) {
    const [[a, b, c], [d, e, f], [g, h, i]] = linear;
    const [x, y, z] = translation_mm;
    out.set(a, b, c, x, d, e, f, y, g, h, i, z, 0, 0, 0, 1).invert();
  } else {
    const [w, x, y, z] = rotation_wxyz;
    out.compose(new Vector3(...translation_mm), new Quaternion(x, y, z, w), new Vector3(scale, scale, scale)).invert();
  }
  const ctFromGltf = new Matrix4().set(1000, 0, 0, 0, 0, 0, -1000, 0, 0, 1000, 0, 0, 0, 0, 0, 1);
  return out.multiply(ctFromGltf);
}
