/** The drawn catheter: tube, roll stripe, beam arrow, and its shadow on the floor. */

import {
  BufferAttribute,
  BufferGeometry,
  ConeGeometry,
  CylinderGeometry,
  DataTexture,
  DynamicDrawUsage,
  Group,
  Line,
  LineBasicMaterial,
  LinearFilter,
  LinearMipmapLinearFilter,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshStandardMaterial,
  Object3D,
  RepeatWrapping,
  SRGBColorSpace,
  Vector3,
} from "three";
import type { Matrix4 } from "three";
import type { TrackMessage } from "../generated/messages";
import { Centreline, RINGS } from "../maths/centreline";
import { COLUMNS, makeTubeArrays, tubeIndices, writeTube } from "../maths/tube";
import type { Settings } from "../settings";

const BEAM_MM = 16;
const BEAM_COLOUR = 0x4dff9e;
const GHOST_COLOUR = 0xff9a1f;
/** Drawn again over the heart, this strongly: it stays legible inside and still looks inside. */
const THROUGH = 0.4;
const OVER_HEART = 35;

export class Catheter {
  readonly group = new Group();
  readonly line = new Centreline();
  /** Number of the drawn Track; -1 while nothing is drawn. */
  seq = -1;
  private radius = 1.5;
  private floor = -60;
  private readonly arrays = makeTubeArrays();
  private readonly geometry = new BufferGeometry();
  private readonly solid: MeshStandardMaterial | MeshLambertMaterial;
  private readonly ghost: MeshStandardMaterial | MeshLambertMaterial;
  private readonly tube: Mesh;
  private readonly through: MeshBasicMaterial;
  private readonly arrow: Object3D;
  private readonly marked = stripes(true);
  private readonly plain = stripes(false);
  private readonly shadow: Float32Array = new Float32Array(3 * RINGS);
  private readonly shadowGeometry = new BufferGeometry();
  private readonly drop: Float32Array = new Float32Array(6);
  private readonly dropGeometry = new BufferGeometry();

  constructor(settings: Settings) {
    const map = this.marked;
    const common = { map, color: 0xffffff };
    const faded = { map, color: GHOST_COLOUR, transparent: true, opacity: 0.35 };
    this.solid = settings.material === "lambert"
      ? new MeshLambertMaterial(common) : new MeshStandardMaterial({ ...common, roughness: 0.45 });
    this.ghost = settings.material === "lambert"
      ? new MeshLambertMaterial(faded) : new MeshStandardMaterial({ ...faded, roughness: 0.45 });
    dynamic(this.geometry, "position", this.arrays.position, 3);
    dynamic(this.geometry, "normal", this.arrays.normal, 3);
    dynamic(this.geometry, "uv", this.arrays.uv, 2);
    this.geometry.setIndex(new BufferAttribute(tubeIndices(), 1));
    this.tube = new Mesh(this.geometry, this.solid);
    this.arrow = makeArrow();
    dynamic(this.shadowGeometry, "position", this.shadow, 3);
    dynamic(this.dropGeometry, "position", this.drop, 3);
    const shadow = new Line(this.shadowGeometry, new LineBasicMaterial({ color: 0x5d7186 }));
    const drop = new Line(this.dropGeometry, new LineBasicMaterial({ color: 0x5d7186, transparent: true, opacity: 0.6 }));
    this.through = new MeshBasicMaterial({ map, transparent: true, opacity: THROUGH, depthWrite: false });
    const through = new Mesh(this.geometry, this.through);
    through.renderOrder = OVER_HEART;
    for (const part of [this.tube, through, shadow, drop]) part.frustumCulled = false; // its bounds change with every Track
    this.group.name = "catheter";
    this.group.add(this.tube, through, this.arrow, shadow, drop);
    this.group.visible = false;
  }

  /** Takes the true diameter and the height of the floor (mm). */
  describe(diameterMm: number, floorMm: number): void {
    this.radius = diameterMm / 2;
    this.floor = floorMm + 0.1;
    this.arrow.position.set(0, 0, 0);
  }

  /** Shows a Track; hides everything when it is lost. Allocates nothing. */
  update(track: TrackMessage): void {
    if (track.points === null || track.tip === null || track.points.length < 2) {
      this.hide();
      return;
    }
    this.line.update(track.points, track.tip.orientation_wxyz, this.radius);
    writeTube(this.arrays, this.line);
    this.writeShadow();
    for (const name of ["position", "normal", "uv"]) this.geometry.attributes[name]!.needsUpdate = true;
    this.shadowGeometry.attributes["position"]!.needsUpdate = true;
    this.dropGeometry.attributes["position"]!.needsUpdate = true;
    const [w, x, y, z] = track.tip.orientation_wxyz;
    this.arrow.position.fromArray(this.line.position);
    this.arrow.quaternion.set(x, y, z, w);
    const coasting = track.status === "coasting";
    this.tube.material = coasting ? this.ghost : this.solid;
    this.through.color.setHex(coasting ? GHOST_COLOUR : 0xffffff);
    this.showBeam(track.roll !== null);
    this.group.visible = true;
    this.seq = track.seq;
  }

  /** Whether the beam is drawn: only where the Track has a valid roll. */
  get beam(): boolean {
    return this.group.visible && this.arrow.visible;
  }

  /** Shows stripe and arrow, or neither: without a valid roll nobody knows where the beam looks. */
  private showBeam(visible: boolean): void {
    this.arrow.visible = visible;
    for (const material of [this.solid, this.ghost, this.through]) material.map = visible ? this.marked : this.plain;
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

  /** The curve on the floor and a plumb line from the tip: they show depth that the picture alone does not. */
  private writeShadow(): void {
    const p = this.line.position;
    for (let ring = 0; ring < RINGS; ring++) {
      this.shadow[3 * ring] = p[3 * ring]!;
      this.shadow[3 * ring + 1] = p[3 * ring + 1]!;
      this.shadow[3 * ring + 2] = this.floor;
    }
    this.drop[0] = this.drop[3] = p[0]!;
    this.drop[1] = this.drop[4] = p[1]!;
    this.drop[2] = p[2]!;
    this.drop[5] = this.floor;
  }
}

function dynamic(geometry: BufferGeometry, name: string, array: Float32Array, size: number): void {
  const attribute = new BufferAttribute(array, size);
  attribute.setUsage(DynamicDrawUsage);
  geometry.setAttribute(name, attribute);
}

/** An arrow from the tip's side along the tip's x axis: where the ultrasound beam points. */
function makeArrow(): Group {
  const material = new MeshBasicMaterial({ color: BEAM_COLOUR, transparent: true }); // so that it comes after the heart
  const shaft = new Mesh(new CylinderGeometry(0.45, 0.45, BEAM_MM - 4, 8), material);
  const head = new Mesh(new ConeGeometry(1.5, 4, 14), material);
  for (const part of [shaft, head]) {
    part.rotation.z = -Math.PI / 2; // from three's y to the tip's x
    part.renderOrder = OVER_HEART;
  }
  shaft.position.x = (BEAM_MM - 4) / 2;
  head.position.x = BEAM_MM - 2;
  const arrow = new Group();
  arrow.name = "beam";
  arrow.add(shaft, head);
  return arrow;
}

/** The tube's skin: ivory, a thin ring each 10 mm, and with `beam` a green stripe where the beam looks out. */
function stripes(beam: boolean): DataTexture {
  const around = 128;
  const along = 64;
  const data = new Uint8Array(4 * around * along);
  for (let row = 0; row < along; row++) {
    for (let column = 0; column < around; column++) {
      const turn = Math.min(column, around - column) / around;
      const colour = beam && turn < 0.1 ? [14, 150, 84] : row < 4 ? [120, 128, 138] : [238, 234, 222];
      data.set([...colour, 255], 4 * (row * around + column));
    }
  }
  const texture = new DataTexture(data, around, along);
  texture.wrapS = texture.wrapT = RepeatWrapping;
  texture.magFilter = LinearFilter;
  texture.minFilter = LinearMipmapLinearFilter;
  texture.generateMipmaps = true;
  texture.anisotropy = 4;
  texture.colorSpace = SRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}
