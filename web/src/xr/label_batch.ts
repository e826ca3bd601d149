/** The labels in a session: all of them from one picture, in one draw call for each eye. */

import type { Object3D, Scene } from "three";
import {
  CanvasTexture, DynamicDrawUsage, InstancedBufferAttribute, InstancedBufferGeometry, LinearFilter, Matrix4, Mesh, PlaneGeometry,
  ShaderMaterial, Sprite, SRGBColorSpace, Vector3,
} from "three";
import { UNSEEN_LAYER } from "./heart_batch";

const ATLAS_PX = 1024;
const GAP_PX = 2;
const MOST = 96;
/** As of the labels themselves (scene/label.ts). */
const ORDER = 40;
const work = { fromWorld: new Matrix4(), matrix: new Matrix4(), place: new Vector3() };

export class LabelBatch {
  private labels: Sprite[] = [];
  private version = -1;
  private readonly canvas = document.createElement("canvas");
  private texture: CanvasTexture | null = null;
  private readonly geometry = new InstancedBufferGeometry();
  private readonly place = attribute(3);
  private readonly size = attribute(2);
  private readonly tint = attribute(4);
  private readonly part = attribute(4);
  private readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;

  /** below: a thing that all labels hang below. */
  constructor(private readonly scene: Scene, private readonly below: Object3D) {
    const quad = new PlaneGeometry(1, 1);
    this.geometry.setIndex(quad.index);
    for (const name of ["position", "uv"] as const) this.geometry.setAttribute(name, quad.getAttribute(name));
    const { place, size, tint, part } = this;
    for (const [name, each] of Object.entries({ place, size, tint, part })) this.geometry.setAttribute(name, each);
    this.mesh = new Mesh(this.geometry, new ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: { map: { value: null } }, transparent: true, depthWrite: false,
    }));
    this.mesh.name = "labels";
    this.mesh.frustumCulled = this.mesh.visible = false;
    this.mesh.renderOrder = ORDER;
    below.add(this.mesh);
  }

  /** Takes over from the labels themselves; `version` counts when there may be others. Called once a frame in a session. */
  update(version: number): void {
    if (version !== this.version) this.collect(version);
    work.fromWorld.copy(this.below.matrixWorld).invert();
    let count = 0;
    let changed = false;
    for (const label of this.labels) {
      if (!this.isShown(label)) continue;
      work.matrix.multiplyMatrices(work.fromWorld, label.matrixWorld);
      work.place.setFromMatrixPosition(work.matrix);
      const { color, opacity } = label.material;
      const at = label.userData["atlas"] as readonly [number, number, number, number];
      changed = write(this.place, count, work.place.x, work.place.y, work.place.z, 0) || changed;
      changed = write(this.size, count, label.scale.x, label.scale.y, 0, 0) || changed;
      changed = write(this.tint, count, color.r, color.g, color.b, opacity) || changed;
      changed = write(this.part, count, at[0], at[1], at[2], at[3]) || changed;
      count += 1;
    }
    this.geometry.instanceCount = count;
    this.mesh.visible = count > 0;
    if (changed) this.place.needsUpdate = this.size.needsUpdate = this.tint.needsUpdate = this.part.needsUpdate = true;
  }

  /** Gives the drawing back to the labels themselves. */
  release(): void {
    for (const label of this.labels) label.layers.set(0);
    this.labels = [];
    this.version = -1;
    this.mesh.visible = false;
    this.texture?.dispose();
    this.texture = null;
  }

  private isShown(label: Sprite): boolean {
    if (label.material.opacity <= 0.01) return false;
    for (let node: Object3D | null = label; node !== null && node !== this.below; node = node.parent) if (!node.visible) return false;
    return true;
  }

  private collect(version: number): void {
    this.version = version;
    const before = this.labels;
    this.labels = [];
    this.scene.traverse((node) => {
      if (!(node instanceof Sprite) || this.labels.length === MOST) return;
      if (node.material.map?.image instanceof HTMLCanvasElement) this.labels.push(node);
    });
    for (const label of this.labels) label.layers.set(UNSEEN_LAYER);
    if (before.length !== this.labels.length || before.some((label, at) => label !== this.labels[at])) this.paint();
  }

  /** Puts the labels' pictures into rows of one. */
  private paint(): void {
    let [x, y, row] = [0, 0, 0];
    const places = this.labels.map((label): [number, number, number, number] => {
      const { width, height } = label.material.map!.image as HTMLCanvasElement;
      if (x + width > ATLAS_PX) [x, y, row] = [0, y + row + GAP_PX, 0];
      const place: [number, number, number, number] = [x, y, width, height];
      x += width + GAP_PX;
      row = Math.max(row, height);
      return place;
    });
    this.canvas.width = ATLAS_PX; // which also clears it
    this.canvas.height = Math.max(64, 2 ** Math.ceil(Math.log2(y + row + 1)));
    const context = this.canvas.getContext("2d")!;
    this.labels.forEach((label, index) => {
      const [left, top, width, height] = places[index]!;
      context.drawImage(label.material.map!.image as HTMLCanvasElement, left, top);
      const high = this.canvas.height;
      label.userData["atlas"] = [left / ATLAS_PX, 1 - (top + height) / high, width / ATLAS_PX, height / high];
    });
    this.texture?.dispose();
    this.texture = new CanvasTexture(this.canvas);
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.minFilter = LinearFilter;
    this.texture.generateMipmaps = false;
    this.mesh.material.uniforms["map"]!.value = this.texture;
  }
}

/** Writes up to four numbers; returns whether any differs by more than could be seen. */
function write({ array, itemSize }: InstancedBufferAttribute, slot: number, a: number, b: number, c: number, d: number): boolean {
  const to = slot * itemSize;
  let changed = false;
  for (let i = 0; i < itemSize; i++) {
    const value = i === 0 ? a : i === 1 ? b : i === 2 ? c : d;
    if (Math.abs(array[to + i]! - value) <= 1e-4 * Math.abs(value)) continue;
    array[to + i] = value;
    changed = true;
  }
  return changed;
}

function attribute(size: number): InstancedBufferAttribute {
  const made = new InstancedBufferAttribute(new Float32Array(size * MOST), size);
  made.setUsage(DynamicDrawUsage);
  return made;
}

/** As three draws a sprite that keeps its size in the eye. */
const VERTEX = `
attribute vec3 place;
attribute vec2 size;
attribute vec4 tint, part;
varying vec2 at;
varying vec4 colour;
void main() {
  at = part.xy + uv * part.zw;
  colour = tint;
  vec4 seen = modelViewMatrix * vec4(place, 1.0);
  vec2 scale = size * vec2(length(modelMatrix[0].xyz), length(modelMatrix[1].xyz));
  seen.xy += position.xy * scale * -seen.z;
  gl_Position = projectionMatrix * seen;
}`;

const FRAGMENT = `
uniform sampler2D map;
varying vec2 at;
varying vec4 colour;
void main() {
  gl_FragColor = texture2D(map, at) * colour;
  if (gl_FragColor.a < 0.004) discard;
  #include <colorspace_fragment>
}`;
