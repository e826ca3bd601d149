/** A place to reach, drawn: the ball, the ring that fills while one stays within it, and the way to it. */

import {
  BufferAttribute, BufferGeometry, Color, DoubleSide, DynamicDrawUsage, Line, LineDashedMaterial, Mesh, MeshBasicMaterial, MeshLambertMaterial,
  Quaternion, RingGeometry, SphereGeometry,
} from "three";
import type { Group, Vector3 } from "three";
import type { Frame } from "../stage/feature";
import type { View } from "./view";

/** What a target's colour says. */
export const TARGET_COLOURS = { open: new Color(0xffd166), near: new Color(0x7dd3fc), reached: new Color(0x4ade80) } as const;
export const BALL_ORDER = 30;
const RING_ORDER = 41;
/** Of the ball's radius, and how finely. */
const RING = { inner: 1.18, outer: 1.34, steps: 60, leastMm: 3 };

export class TargetMark {
  readonly ball: Mesh<SphereGeometry, MeshLambertMaterial>;
  readonly ring: Mesh<RingGeometry, MeshBasicMaterial>;
  readonly way: Line<BufferGeometry, LineDashedMaterial>;
  private readonly wayEnds = new BufferAttribute(new Float32Array(6), 3).setUsage(DynamicDrawUsage);
  private readonly wayLengths = new BufferAttribute(new Float32Array(2), 1).setUsage(DynamicDrawUsage);
  private readonly boxTurn = new Quaternion();

  /** group: what it is drawn in, whose axes are the box's, in mm. */
  constructor(group: Group) {
    const color = TARGET_COLOURS.open;
    this.ball = new Mesh(new SphereGeometry(1, 32, 20), new MeshLambertMaterial({ color, transparent: true, opacity: 0.4, depthWrite: false }));
    this.ball.renderOrder = BALL_ORDER;
    const geometry = new BufferGeometry().setAttribute("position", this.wayEnds).setAttribute("lineDistance", this.wayLengths);
    this.way = new Line(geometry, new LineDashedMaterial({ color, dashSize: 2, gapSize: 1.5, transparent: true, opacity: 0.85 }));
    this.way.frustumCulled = false;
    this.way.renderOrder = BALL_ORDER;
    // From the top, clockwise; seen through everything.
    const ring = new RingGeometry(RING.inner, RING.outer, RING.steps, 1, Math.PI / 2, -2 * Math.PI);
    const paint = { color: TARGET_COLOURS.reached, side: DoubleSide, transparent: true, depthTest: false };
    this.ring = new Mesh(ring, new MeshBasicMaterial(paint));
    this.ring.renderOrder = RING_ORDER;
    this.ring.visible = false;
    group.add(this.ball, this.way, this.ring);
  }

  /** Puts the ball and its ring at a place, mm. */
  place(at: Vector3, radiusMm: number): void {
    this.ball.position.copy(at);
    this.ball.scale.setScalar(radiusMm);
    this.ring.position.copy(at);
    this.ring.scale.setScalar(Math.max(RING.leastMm, radiusMm));
  }

  /** Where the way begins, mm. */
  wayFrom(x: number, y: number, z: number): void {
    this.wayEnds.setXYZ(0, x, y, z);
  }

  /** Where the way ends, mm, and its length, which its dashes follow. */
  wayTo(x: number, y: number, z: number, lengthMm: number): void {
    this.wayEnds.setXYZ(1, x, y, z);
    this.wayLengths.setX(1, lengthMm);
    this.wayEnds.needsUpdate = this.wayLengths.needsUpdate = true;
  }

  /** Fills the visible ring to a share of 0..1, and turns it to the eye. */
  fillRing(share: number, { immersive }: Frame, view: View): void {
    const eye = immersive ? view.head.orientation : view.camera.quaternion;
    this.ring.quaternion.copy(view.box.getWorldQuaternion(this.boxTurn).invert().multiply(eye));
    this.ring.geometry.setDrawRange(0, 6 * Math.ceil(RING.steps * share));
  }
}
