/** The drawn catheter: tube, roll stripe, beam arrow, and its shadow on the floor. */

import {
  BufferAttribute,
  BufferGeometry,
  ConeGeometry,
  CylinderGeometry,
  DynamicDrawUsage,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshStandardMaterial,
  Vector3,
} from "three";
import type { Material, Matrix4 } from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { Centreline, RINGS } from "../maths/centreline";
import type { DrawnTrack } from "../motion/drawn";
import { COLUMNS, makeTubeArrays, tubeIndices, writeTube } from "../maths/tube";
import { MOST_POINTS } from "../motion/snapshot";
import type { Settings } from "../settings";
import type { SkinUniforms } from "./catheter_skin";
import { markTip, stripes } from "./catheter_skin";

const BEAM_MM = 16;
const BEAM_COLOUR = 0x4dff9e;
const GHOST_COLOUR = 0xff9a1f;
/** Drawn again over the heart, this strongly: it stays legible inside and still looks inside. */
const THROUGH = 0.4;
const OVER_HEART = 35;
/** How much is left of the catheter while something else counts. */
const FADED = 0.16;
/** In the wall the skin is multiplied by this, in full from this depth on. */
const WALL_COLOUR = [1, 0.1, 0.32] as const;
const DEEP_MM = 1.5;
/** Changes below these are not worth a new picture: a tenth of a pixel on a page. At rest the page then rests too. */
const SEEN_MM = 0.01;
const SEEN_TURN = 3e-4;

export class Catheter {
  readonly group = new Group();
  readonly line = new Centreline();
  /** Number of the newest Track in what is drawn; -1 while nothing is. */
  seq = -1;
  /** The instant that is drawn, seconds of the Tracks' clock. */
  t = 0;
  private radius = 1.5;
  private floor = -60;
  private readonly arrays = makeTubeArrays();
  readonly geometry = new BufferGeometry();
  private readonly position: BufferAttribute;
  private readonly normal: BufferAttribute;
  private readonly uv: BufferAttribute;
  private readonly shadowPosition: BufferAttribute;
  /** What was written last, and how it looked. */
  private readonly last = { points: new Float64Array(3 * MOST_POINTS), orientation: new Float64Array(4) };
  private look = -1;
  private wantsArrow = true;
  private readonly solid: MeshStandardMaterial | MeshLambertMaterial;
  private readonly ghost: MeshStandardMaterial | MeshLambertMaterial;
  private readonly tube: Mesh;
  private readonly through: MeshBasicMaterial;
  private readonly arrow: Mesh;
  private readonly marked = stripes(true);
  private readonly plain = stripes(false);
  private readonly skin: SkinUniforms = { rolled: { value: 1 } };
  /** Pieces of the shadow's line, ring by ring, and the plumb line. */
  private readonly shadow = new Float32Array(6 * RINGS);
  private readonly shadowGeometry = new BufferGeometry();
  private readonly colours = new Float32Array(3 * RINGS * COLUMNS).fill(1);
  private readonly colour: BufferAttribute;

  constructor(settings: Settings) {
    const map = this.marked;
    const common = { map, color: 0xffffff, vertexColors: true };
    const faded = { map, color: GHOST_COLOUR, transparent: true, opacity: 0.35, vertexColors: true };
    this.solid = settings.material === "lambert"
      ? new MeshLambertMaterial(common) : new MeshStandardMaterial({ ...common, roughness: 0.45 });
    this.ghost = settings.material === "lambert"
      ? new MeshLambertMaterial(faded) : new MeshStandardMaterial({ ...faded, roughness: 0.45 });
    this.position = dynamic(this.geometry, "position", this.arrays.position, 3);
    this.normal = dynamic(this.geometry, "normal", this.arrays.normal, 3);
    this.uv = dynamic(this.geometry, "uv", this.arrays.uv, 2);
    this.colour = dynamic(this.geometry, "color", this.colours, 3);
    this.geometry.setIndex(new BufferAttribute(tubeIndices(), 1));
    this.tube = new Mesh(this.geometry, this.solid);
    this.arrow = makeArrow();
    this.shadowPosition = dynamic(this.shadowGeometry, "position", this.shadow, 3);
    const shadow = new LineSegments(this.shadowGeometry, new LineBasicMaterial({ color: 0x5d7186, transparent: true, opacity: 0.8 }));
    shadow.name = "floor";
    this.through = new MeshBasicMaterial({ map, transparent: true, opacity: THROUGH, depthWrite: false, vertexColors: true });
    for (const material of [this.solid, this.ghost, this.through]) markTip<Material>(material, this.skin);
    const through = new Mesh(this.geometry, this.through);
    through.renderOrder = OVER_HEART;
    for (const part of [this.tube, through, shadow]) part.frustumCulled = false; // its bounds change with every Track
    this.group.name = "catheter";
    this.group.add(this.tube, through, this.arrow, shadow);
    this.group.visible = false;
  }

  /** Takes the true diameter and the height of the floor (mm). */
  describe(diameterMm: number, floorMm: number): void {
    this.radius = diameterMm / 2;
    this.floor = floorMm + 0.1;
    this.look = -1;
  }

  /**
   * Shows what is to be drawn; hides everything when it is lost. Returns whether anything has changed: a catheter that
   * rests is not written again. Allocates nothing.
   */
  update(track: DrawnTrack | null): boolean {
    if (track === null || track.status === "lost" || track.count < 2) {
      const was = this.group.visible;
      this.hide();
      return was;
    }
    this.seq = track.seq;
    this.t = track.t;
    if (!this.moved(track)) return false;
    this.line.update(track.points, track.count, track.orientation, this.radius);
    writeTube(this.arrays, this.line);
    this.writeShadow();
    this.position.needsUpdate = this.normal.needsUpdate = this.uv.needsUpdate = true;
    this.shadowPosition.needsUpdate = true;
    const q = track.orientation;
    this.arrow.position.fromArray(this.line.position);
    this.arrow.quaternion.set(q[1]!, q[2]!, q[3]!, q[0]!);
    const ghost = track.status === "coasting" || track.stale;
    this.tube.material = ghost ? this.ghost : this.solid;
    this.through.color.setHex(ghost ? GHOST_COLOUR : 0xffffff);
    this.showBeam(track.roll !== null);
    this.group.visible = true;
    return true;
  }

  /** Returns whether a pose differs from the one drawn by more than could be seen, and if so keeps it. */
  private moved(track: DrawnTrack): boolean {
    const { last } = this;
    const look = (track.status === "coasting" || track.stale ? 1 : 0) + (track.roll !== null ? 2 : 0) + 4 * track.count;
    let moved = !this.group.visible || look !== this.look;
    for (let i = 0; !moved && i < 3 * track.count; i++) moved = Math.abs(track.points[i]! - last.points[i]!) > SEEN_MM;
    for (let i = 0; !moved && i < 4; i++) moved = Math.abs(track.orientation[i]! - last.orientation[i]!) > SEEN_TURN;
    if (!moved) return false;
    this.look = look;
    last.points.set(track.points);
    last.orientation.set(track.orientation);
    return true;
  }

  /** Whether a catheter is drawn. */
  get shown(): boolean {
    return this.group.visible;
  }

  /** Whether it is drawn where the beam looks: only where the Track has a valid roll. */
  get beam(): boolean {
    return this.group.visible && this.skin.rolled.value === 1;
  }

  /** Shows stripe and arrow, or neither: without a valid roll nobody knows where the beam looks. */
  private showBeam(visible: boolean): void {
    this.arrow.visible = visible && this.wantsArrow;
    for (const material of [this.solid, this.ghost, this.through]) material.map = visible ? this.marked : this.plain;
    this.skin.rolled.value = visible ? 1 : 0;
  }

  hide(): void {
    this.group.visible = false;
    this.seq = -1;
  }

  /** Writes where the tip is drawn, mm in `box`: the first ring's vertices through the mesh's own transforms. */
  drawnTip(boxFromScene: Matrix4, out: Vector3): Vector3 {
    const vertex = new Vector3();
    out.set(0, 0, 0);
    this.tube.updateWorldMatrix(true, false);
    const positions = this.geometry.attributes["position"]!;
    for (let i = 0; i < COLUMNS; i++) {
      out.add(vertex.fromBufferAttribute(positions, i).applyMatrix4(this.tube.matrixWorld));
    }
    return out.divideScalar(COLUMNS).applyMatrix4(boxFromScene);
  }

  /**
   * Colours the tube where it is in the wall. depths: of `count` points from the tip to the entry, mm; null: nowhere.
   * Returns whether that has changed.
   */
  tint(depths: Float32Array | null, count: number): boolean {
    let changed = false;
    const total = this.line.along[RINGS - 1]! || 1;
    for (let ring = 0; ring < RINGS; ring++) {
      let depth = 0;
      if (depths !== null) {
        const at = Math.min(((count - 1) * this.line.along[ring]!) / total, count - 1);
        const low = Math.min(Math.floor(at), count - 2);
        depth = depths[low]! + (at - low) * (depths[low + 1]! - depths[low]!);
      }
      const share = depth <= 0 ? 0 : Math.min(1, 0.6 + 0.4 * (depth / DEEP_MM));
      changed = this.colourRing(ring, share) || changed;
    }
    if (changed) this.colour.needsUpdate = true;
    return changed;
  }

  /** Whether the arrow is drawn where the beam looks; not beside the beam itself. */
  set pointing(on: boolean) {
    this.wantsArrow = on;
    this.arrow.visible = on && this.skin.rolled.value === 1;
  }

  /** Whether it stands back behind something else that is shown: a run that is played again. */
  set faded(on: boolean) {
    this.solid.transparent = on;
    this.solid.opacity = on ? FADED : 1;
    this.solid.depthWrite = this.ghost.depthWrite = !on;
    this.ghost.opacity = on ? FADED : 0.35;
    this.through.opacity = on ? 0.3 * FADED : THROUGH;
    this.solid.needsUpdate = true;
  }

  private colourRing(ring: number, share: number): boolean {
    const first = 3 * ring * COLUMNS;
    const green = Math.fround(1 - (1 - WALL_COLOUR[1]) * share);
    if (Math.abs(this.colours[first + 1]! - green) < 0.004) return false;
    for (let at = first; at < first + 3 * COLUMNS; at += 3) {
      for (let part = 0; part < 3; part++) this.colours[at + part] = 1 - (1 - WALL_COLOUR[part]!) * share;
    }
    return true;
  }

  /** The curve on the floor and a plumb line from the tip: they show depth that the picture alone does not. */
  private writeShadow(): void {
    const p = this.line.position;
    const { shadow, floor } = this;
    for (let ring = 0; ring < RINGS - 1; ring++) {
      for (let end = 0; end < 2; end++) {
        const to = 6 * ring + 3 * end;
        shadow[to] = p[3 * (ring + end)]!;
        shadow[to + 1] = p[3 * (ring + end) + 1]!;
        shadow[to + 2] = floor;
      }
    }
    const last = 6 * (RINGS - 1);
    for (let end = 0; end < 2; end++) {
      shadow[last + 3 * end] = p[0]!;
      shadow[last + 3 * end + 1] = p[1]!;
      shadow[last + 3 * end + 2] = end === 0 ? p[2]! : floor;
    }
  }
}

function dynamic(geometry: BufferGeometry, name: string, array: Float32Array, size: number): BufferAttribute {
  const attribute = new BufferAttribute(array, size);
  attribute.setUsage(DynamicDrawUsage);
  geometry.setAttribute(name, attribute);
  return attribute;
}

/** An arrow from the tip's side along the tip's x axis: where the ultrasound beam points. */
function makeArrow(): Mesh {
  const shaft = new CylinderGeometry(0.45, 0.45, BEAM_MM - 4, 8);
  const head = new ConeGeometry(1.5, 4, 14);
  shaft.translate(0, (BEAM_MM - 4) / 2, 0);
  head.translate(0, BEAM_MM - 2, 0);
  const geometry = mergeGeometries([shaft, head]).rotateZ(-Math.PI / 2); // from three's y to the tip's x
  const arrow = new Mesh(geometry, new MeshBasicMaterial({ color: BEAM_COLOUR, transparent: true })); // so that it comes after the heart
  arrow.renderOrder = OVER_HEART;
  arrow.name = "beam";
  return arrow;
}
