/** Two trapezoids at a target: the plane that is wanted, and the one that the beam has now; alike when they lie together. */

import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, LineBasicMaterial, LineSegments, Vector3 } from "three";
import type { TrainingTarget } from "../../generated/messages";
import type { TipPose } from "../../stage/feature";

/** Along the beam before and behind the target, and half the widths there, mm: the middle of an ultrasound sector. */
const BEFORE_MM = 30;
const BEHIND_MM = 14;
const NARROW_MM = 9;
const WIDE_MM = 26;
const NOW = new Color(0x4dff9e);
/** Corners of a trapezoid: along the beam, and across. */
const CORNERS: readonly (readonly [number, number])[] = [[-BEFORE_MM, -NARROW_MM], [-BEFORE_MM, NARROW_MM], [BEHIND_MM, WIDE_MM], [BEHIND_MM, -WIDE_MM]];
/** Its four sides, and its middle line: which way the beam goes. */
const ENDS = CORNERS.length * 2 + 2;
const ORDER = 37;
const work = { at: new Vector3(), along: new Vector3(), across: new Vector3(), normal: new Vector3() };

export class PlaneFrame {
  readonly lines: LineSegments<BufferGeometry, LineBasicMaterial>;
  private readonly places = new BufferAttribute(new Float32Array(2 * 3 * ENDS), 3).setUsage(DynamicDrawUsage);
  private readonly colours = new BufferAttribute(new Float32Array(2 * 3 * ENDS), 3).setUsage(DynamicDrawUsage);

  constructor() {
    const geometry = new BufferGeometry().setAttribute("position", this.places).setAttribute("color", this.colours);
    this.lines = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true, transparent: true, opacity: 0.75 }));
    this.lines.name = "wanted plane";
    this.lines.frustumCulled = false;
    this.lines.renderOrder = ORDER;
    this.lines.visible = false;
    for (let i = ENDS; i < 2 * ENDS; i++) this.colours.setXYZ(i, NOW.r, NOW.g, NOW.b);
  }

  /** Colours the plane that is wanted. */
  tint(colour: Color): void {
    for (let i = 0; i < ENDS; i++) this.colours.setXYZ(i, colour.r, colour.g, colour.b);
    this.colours.needsUpdate = true;
  }

  /** Places both; `known`: whether the beam's own plane is. Allocates nothing. */
  show(target: TrainingTarget, tip: TipPose, known: boolean): void {
    const { at, along, across, normal } = work;
    const m = tip.matrix.elements;
    at.set(target.position_mm[0], target.position_mm[1], target.position_mm[2]);
    const beam = target.kind === "plane" ? target.up : target.direction;
    if (beam === null) return;
    along.set(beam[0], beam[1], beam[2]);
    if (target.kind === "plane" && target.direction !== null) {
      normal.set(target.direction[0], target.direction[1], target.direction[2]);
      across.crossVectors(normal, along).normalize();
      along.crossVectors(across, normal).normalize();
    } else {
      across.set(m[8]!, m[9]!, m[10]!).addScaledVector(along, -(m[8]! * along.x + m[9]! * along.y + m[10]! * along.z)).normalize();
    }
    this.write(0);
    if (known) {
      // The beam's plane is shown where it is nearest to the target.
      const off = (at.x - m[12]!) * m[4]! + (at.y - m[13]!) * m[5]! + (at.z - m[14]!) * m[6]!;
      at.set(at.x - off * m[4]!, at.y - off * m[5]!, at.z - off * m[6]!);
      along.set(m[0]!, m[1]!, m[2]!);
      across.set(m[8]!, m[9]!, m[10]!);
      this.write(ENDS);
    }
    this.lines.geometry.setDrawRange(0, known ? 2 * ENDS : ENDS);
    this.places.needsUpdate = true;
  }

  private write(from: number): void {
    let to = from;
    for (let i = 0; i < CORNERS.length; i++) {
      const a = CORNERS[i]!;
      const b = CORNERS[(i + 1) % CORNERS.length]!;
      this.put(to++, a[0], a[1]);
      this.put(to++, b[0], b[1]);
    }
    this.put(to++, -BEFORE_MM, 0);
    this.put(to, BEHIND_MM, 0);
  }

  private put(index: number, along: number, across: number): void {
    const { at, along: a, across: c } = work;
    this.places.setXYZ(index, at.x + along * a.x + across * c.x, at.y + along * a.y + across * c.y, at.z + along * a.z + across * c.z);
  }
}
