/** The heart in a session: what its parts' own meshes say is to be drawn, in one or two draw calls for each eye. */

import type { Group, Plane } from "three";
import { BackSide, BatchedMesh, BufferAttribute, BufferGeometry, Color, FrontSide, Group as Holder, Mesh, Vector4 } from "three";
import type { Material } from "three";
import { CUT_FACE } from "../scene/heart_materials";
import type { Heart } from "../scene/heart";

/** What stands in for others is seen, those are not: no camera looks at this layer. */
export const UNSEEN_LAYER = 6;
/** wall: all that is seen by somebody who is within; the others as the parts' own materials are. */
type Kind = "depth" | "cut" | "far" | "far solid" | "near" | "near solid" | "wall";
type Part = Mesh<BufferGeometry, Material & { readonly color?: Color }>;

const work = { colour: new Vector4() };
const WHITE = new Color(0xffffff);

/** All surfaces that are drawn in one way. */
class Batch {
  readonly mesh: BatchedMesh;
  /** Meshes to draw in this frame, by their number, in order. */
  readonly order: Int32Array;
  count = 0;
  private readonly shown: Int32Array;
  private readonly colours: Float32Array;
  private readonly material: Material;

  constructor(kind: Kind, like: Material, surfaces: readonly BufferGeometry[], private readonly most: number) {
    this.material = like.clone();
    this.material.onBeforeCompile = kind === "wall" ? mottledBy(like) : like.onBeforeCompile; // three copies all but this
    (this.material as Part["material"]).color?.copy(WHITE);
    this.material.opacity = 1;
    this.material.clippingPlanes = null;
    const vertices = surfaces.reduce((sum, { attributes }) => sum + attributes["position"]!.count, 0);
    const indices = surfaces.reduce((sum, { index }) => sum + index!.count, 0);
    this.mesh = new BatchedMesh(most, vertices, indices, this.material);
    this.mesh.name = `heart, ${kind}`;
    this.mesh.perObjectFrustumCulled = this.mesh.sortObjects = this.mesh.frustumCulled = false;
    for (const surface of surfaces) this.mesh.addGeometry(surface);
    for (let slot = 0; slot < most; slot++) {
      this.mesh.addInstance(0);
      this.mesh.setVisibleAt(slot, false);
    }
    this.order = new Int32Array(most);
    this.shown = new Int32Array(most).fill(-1);
    this.colours = new Float32Array(4 * most).fill(-1);
  }

  /** Draws what is in `order`. looks: instead of the parts' own; surfaceOf: of each part, its surface. Allocates nothing. */
  show(parts: readonly Part[], looks: readonly Part["material"][] | null, surfaceOf: Int32Array): void {
    const { mesh, shown, order } = this;
    mesh.visible = this.count > 0;
    for (let slot = 0; slot < this.most; slot++) {
      const wanted = slot < this.count ? surfaceOf[order[slot]!]! : -1;
      if (wanted !== shown[slot]) {
        mesh.setVisibleAt(slot, wanted >= 0);
        if (wanted >= 0) mesh.setGeometryIdAt(slot, wanted);
        shown[slot] = wanted;
      }
      if (wanted >= 0) this.colour(slot, looks === null ? parts[order[slot]!]!.material : looks[wanted]!);
    }
    if (this.count > 0) {
      const first = parts[order[0]!]!;
      mesh.renderOrder = first.renderOrder;
      this.cut(first.material.clippingPlanes ?? NONE);
    }
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.dispose();
    this.material.dispose();
  }

  private colour(slot: number, { color, opacity }: Part["material"]): void {
    const { r, g, b } = color ?? WHITE;
    const to = 4 * slot;
    const { colours } = this;
    const same = colours[to] === Math.fround(r) && colours[to + 1] === Math.fround(g) && colours[to + 2] === Math.fround(b);
    if (same && colours[to + 3] === Math.fround(opacity)) return;
    colours[to] = r;
    colours[to + 1] = g;
    colours[to + 2] = b;
    colours[to + 3] = opacity;
    this.mesh.setColorAt(slot, work.colour.set(r, g, b, opacity));
  }

  private cut(planes: readonly Plane[]): void {
    if (this.material.clippingPlanes === planes) return;
    if ((this.material.clippingPlanes?.length ?? 0) !== planes.length) this.material.needsUpdate = true;
    this.material.clippingPlanes = planes as Plane[];
  }
}

const NONE: readonly Plane[] = [];

export class HeartBatch {
  private readonly holder = new Holder();
  private readonly batches = new Map<Kind, Batch>();
  private parts: Part[] = [];
  private surfaces: BufferGeometry[] = [];
  /** The inner wall's look, by surface. */
  private walls: Part["material"][] = [];
  private surfaceOf = new Int32Array(0);
  private version = -1;

  /** below: what the heart itself hangs below. */
  constructor(private readonly heart: Heart, below: Group) {
    this.holder.name = "heart batches";
    this.holder.matrixAutoUpdate = false;
    below.add(this.holder);
  }

  /**
   * Takes over from the heart's own meshes; called once a frame while a session runs, after they are as they should be.
   * within: whether the viewer's head is in the blood, where only walls are seen, solid and mottled.
   */
  update(within: boolean): void {
    if (this.version !== this.heart.version) this.adopt();
    const { group } = this.heart;
    this.holder.visible = group.visible;
    for (const batch of this.batches.values()) batch.count = 0;
    for (let index = 0; index < this.parts.length; index++) {
      const part = this.parts[index]!;
      if (!part.visible) continue;
      const kind = kindOf(part.material);
      if (!within) this.insert(this.batchFor(kind, part.material), index);
      else if (part.material.side === FrontSide && kind !== "depth") this.insert(this.batchFor("wall", this.walls[0]!), index);
    }
    for (const [kind, batch] of this.batches) batch.show(this.parts, kind === "wall" ? this.walls : null, this.surfaceOf);
  }

  /** Gives the drawing back to the heart's own meshes. */
  release(): void {
    this.version = -1;
    for (const part of this.parts) part.layers.set(0);
    for (const batch of this.batches.values()) batch.dispose();
    for (const surface of this.surfaces) surface.dispose();
    this.batches.clear();
    this.parts = [];
    this.surfaces = [];
    this.walls = [];
  }

  private adopt(): void {
    this.release();
    this.version = this.heart.version;
    const { group } = this.heart;
    this.holder.matrix.copy(group.matrix);
    this.holder.matrixWorldNeedsUpdate = true;
    const known = new Map<BufferGeometry, number>();
    const inner = new Map<BufferGeometry, Part["material"]>();
    this.heart.inside.traverse((node) => {
      if (node instanceof Mesh) inner.set((node as Part).geometry, (node as Part).material);
    });
    const surfaceOf: number[] = [];
    group.traverse((node) => {
      if (!(node instanceof Mesh)) return;
      const part = node as Part;
      if (!known.has(part.geometry)) {
        known.set(part.geometry, this.surfaces.length);
        this.surfaces.push(bare(part));
        this.walls.push(inner.get(part.geometry) ?? part.material);
      }
      part.layers.set(UNSEEN_LAYER);
      this.parts.push(part);
      surfaceOf.push(known.get(part.geometry)!);
    });
    this.surfaceOf = Int32Array.from(surfaceOf);
  }

  private batchFor(kind: Kind, material: Material): Batch {
    let batch = this.batches.get(kind);
    if (batch === undefined) {
      batch = new Batch(kind, material, this.surfaces, this.parts.length);
      this.batches.set(kind, batch);
      this.holder.add(batch.mesh);
    }
    return batch;
  }

  private insert(batch: Batch, index: number): void {
    const { order } = batch;
    let at = batch.count++;
    const rank = this.parts[index]!.renderOrder;
    while (at > 0 && this.parts[order[at - 1]!]!.renderOrder > rank) {
      order[at] = order[at - 1]!;
      at -= 1;
    }
    order[at] = index;
  }
}

function kindOf(material: Material): Kind {
  if (!material.colorWrite) return "depth";
  if (material.name === CUT_FACE) return "cut";
  if (material.side === BackSide) return material.transparent ? "far" : "far solid";
  return material.transparent ? "near" : "near solid";
}

/** The inner wall's mottle goes by millimetres of the heart, however the world is scaled. */
function mottledBy(like: Material): Material["onBeforeCompile"] {
  return (shader, renderer) => {
    like.onBeforeCompile(shader, renderer);
    shader.vertexShader = shader.vertexShader.replace("(modelMatrix * vec4(position, 1.0)).xyz", "1000.0 * position");
  };
}

/** Returns a part's surface where it stands in the heart, with nothing but what the heart's materials need. */
function bare({ geometry, matrix }: Part): BufferGeometry {
  const surface = new BufferGeometry();
  for (const name of ["position", "normal"]) surface.setAttribute(name, geometry.getAttribute(name).clone() as BufferAttribute);
  const { count } = geometry.getAttribute("position");
  surface.setIndex(geometry.index ?? new BufferAttribute(Uint32Array.from({ length: count }, (_, at) => at), 1));
  return surface.applyMatrix4(matrix);
}
