/** One part of the heart: its surfaces, in the ways in which they can be drawn. */

import { BackSide, Box3, FrontSide, Group, Mesh, Vector3 } from "three";
import type { BufferGeometry, Material, Matrix4, Plane } from "three";
import type { PartDescription } from "../generated/messages";
import type { Settings } from "../settings";
import { cutFace, depthOnly, innerWall, translucent } from "./heart_materials";

export const DEFAULT_OPACITY = 0.16;
/** Denser than this, only the nearest face of a part is seen: its depth is written first. */
const DENSE = 0.6;
const OPAQUE = 0.985;
const UNSEEN = 0.01;
/** What cut open can be seen through is left this share of it: a cut face is no glass. */
const CUT_CLEARNESS = 0.12;
const NO_PLANES: Plane[] = [];

/** One surface of a part, drawn up to four times over. */
interface Surface {
  readonly far: Mesh<BufferGeometry, Material>;
  readonly depth: Mesh<BufferGeometry, Material>;
  readonly near: Mesh<BufferGeometry, Material>;
  readonly inside: Mesh<BufferGeometry, Material>;
}

export class HeartPart {
  /** Middle and half the size along x, y, z of what is drawn, `box`, mm. */
  readonly centre = new Vector3();
  readonly half = new Vector3();
  /** The inner wall, for the view from the tip; hangs in another scene. */
  readonly inside = new Group();
  opacity = DEFAULT_OPACITY;
  visible = true;
  private readonly surfaces: Surface[] = [];
  private readonly materials: { readonly far: Material; readonly cut: Material; readonly depth: Material; readonly near: Material; readonly inside: Material };
  private planes: Plane[] = NO_PLANES;
  private readonly singlePass: boolean;

  constructor(readonly description: PartDescription, settings: Settings) {
    const { colour } = description;
    this.singlePass = settings.material === "lambert";
    this.materials = {
      far: translucent(settings, colour, BackSide),
      cut: cutFace(colour),
      depth: depthOnly(),
      near: translucent(settings, colour, FrontSide),
      inside: innerWall(colour),
    };
  }

  /** Takes a surface in. place: where it stands in the heart's file; into: what it is drawn below. */
  add(geometry: BufferGeometry, place: Matrix4, into: Group): void {
    const make = (material: Material): Mesh<BufferGeometry, Material> => {
      const mesh = new Mesh(geometry, material);
      mesh.matrixAutoUpdate = false;
      mesh.matrix.copy(place);
      return mesh;
    };
    const surface = {
      far: make(this.materials.far),
      depth: make(this.materials.depth),
      near: make(this.materials.near),
      inside: make(this.materials.inside),
    };
    this.surfaces.push(surface);
    into.add(surface.far, surface.depth, surface.near);
    this.inside.add(surface.inside);
  }

  /** Works out where it is, once all its surfaces are there. boxFromHeart: where what they are drawn below stands. */
  measure(boxFromHeart: Matrix4): void {
    const bounds = new Box3();
    const one = new Box3();
    for (const { near } of this.surfaces) {
      near.geometry.computeBoundingBox();
      bounds.union(one.copy(near.geometry.boundingBox!).applyMatrix4(near.matrix).applyMatrix4(boxFromHeart));
    }
    bounds.getCenter(this.centre);
    bounds.getSize(this.half).multiplyScalar(0.5);
    this.apply();
  }

  /** Hides the part, or shows it with an opacity from 0 to 1. */
  show(visible: boolean, opacity: number): void {
    this.visible = visible;
    this.opacity = opacity;
    this.apply();
  }

  /** Cuts it open by planes in the scene's frame; none: whole. The same array may be given with other planes in it. */
  cut(planes: Plane[]): void {
    if (this.planes === planes) return;
    this.planes = planes;
    for (const material of Object.values(this.materials)) {
      if (material === this.materials.inside) continue;
      if ((material.clippingPlanes?.length ?? 0) !== planes.length) material.needsUpdate = true;
      material.clippingPlanes = planes;
    }
    this.apply();
  }

  /** Says in which order to draw it: its far faces at one place, its near ones at another. */
  order(far: number, near: number): void {
    for (const surface of this.surfaces) {
      surface.far.renderOrder = far;
      surface.depth.renderOrder = near;
      surface.near.renderOrder = near;
    }
  }

  dispose(): void {
    for (const { near } of this.surfaces) near.geometry.dispose();
    for (const material of Object.values(this.materials)) material.dispose();
  }

  private apply(): void {
    const cut = this.planes.length > 0;
    const opacity = cut ? 1 - (1 - this.opacity) * CUT_CLEARNESS : this.opacity;
    const opaque = opacity > OPAQUE;
    const seen = this.visible && this.opacity > UNSEEN;
    for (const { far, depth, near } of this.surfaces) {
      far.material = cut ? this.materials.cut : this.materials.far;
      far.visible = seen && (cut || opaque || !this.singlePass); // through an opening one sees the far wall
      near.visible = seen;
      depth.visible = seen && !opaque && opacity >= DENSE;
    }
    for (const material of [this.materials.far, this.materials.near]) {
      material.opacity = opacity;
      if (material.transparent === opaque) material.needsUpdate = true;
      material.transparent = !opaque;
      material.depthWrite = opaque;
    }
  }
}
