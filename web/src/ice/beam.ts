/** The beam in the scene: the sector with the picture in it, its outline, and the ball at its far end. */

import {
  BufferAttribute, BufferGeometry, DynamicDrawUsage, Group, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, SphereGeometry,
} from "three";
import { IceFan } from "../ultrasound";
import type { FanGeometry, IceImager } from "../ultrasound";

const ARC_STEPS = 32;
/** Two sides, the far arc, the face, and the centre line that ends in the ball. */
const SEGMENTS = ARC_STEPS + 4;
const BALL_MM = 2.2;
const COLOURS = { tracked: 0x4dff9e, coasting: 0xff9a1f } as const;
/** Before the heart's walls, so that what lies in front of the plane tints it, and what lies behind is hidden by it. */
const FAN_ORDER = 5;
const OUTLINE_ORDER = 36;

/** Below `box`, mm. Three draw calls: picture, outline, ball. */
export class Beam {
  readonly group = new Group();
  readonly fan: IceFan;
  /** The middle of the far edge; its matrix is what a test reads. */
  readonly ball: Mesh<SphereGeometry, MeshBasicMaterial>;
  private readonly outlined = new Group();
  private readonly places = new BufferAttribute(new Float32Array(6 * SEGMENTS), 3).setUsage(DynamicDrawUsage);
  private readonly outline: LineSegments<BufferGeometry, LineBasicMaterial>;

  constructor(private readonly imager: IceImager, shape: FanGeometry) {
    this.fan = new IceFan(imager, shape);
    this.fan.renderOrder = FAN_ORDER;
    this.fan.material.depthWrite = true;
    this.fan.frustumCulled = false;
    this.fan.matrixAutoUpdate = false;
    const geometry = new BufferGeometry().setAttribute("position", this.places);
    this.outline = new LineSegments(geometry, new LineBasicMaterial({ color: COLOURS.tracked, transparent: true, opacity: 0.9 }));
    this.outline.frustumCulled = false;
    this.ball = new Mesh(new SphereGeometry(BALL_MM, 20, 14), new MeshBasicMaterial({ color: COLOURS.tracked, transparent: true }));
    this.outline.renderOrder = this.ball.renderOrder = OUTLINE_ORDER;
    this.outlined.matrixAutoUpdate = false;
    this.outlined.add(this.outline, this.ball);
    this.group.name = "ice beam";
    this.group.add(this.fan, this.outlined);
    this.group.visible = false;
    this.fit();
  }

  /** Follows the imager's sector and depth. */
  fit(): void {
    this.fan.fit();
    const { sectorRad, depthMm, apexMm } = this.imager.settings;
    const half = sectorRad / 2;
    let at = 0;
    const line = (r: number, angle: number, toR: number, toAngle: number): void => {
      this.places.setXYZ(at++, (apexMm + r) * Math.cos(angle) - apexMm, 0, (apexMm + r) * Math.sin(angle));
      this.places.setXYZ(at++, (apexMm + toR) * Math.cos(toAngle) - apexMm, 0, (apexMm + toR) * Math.sin(toAngle));
    };
    for (const side of [-half, half]) line(0, side, depthMm, side);
    line(0, -half, 0, half);
    line(depthMm, 0, depthMm * 0.94, 0);
    for (let i = 0; i < ARC_STEPS; i++) {
      line(depthMm, (i / ARC_STEPS - 0.5) * sectorRad, depthMm, ((i + 1) / ARC_STEPS - 0.5) * sectorRad);
    }
    this.places.needsUpdate = true;
    this.ball.position.set(depthMm, 0, 0);
  }

  /** Takes box_from_transducer, mm, of the beam. */
  place(boxFromTransducer: Matrix4): void {
    this.outlined.matrix.copy(boxFromTransducer);
    this.outlined.matrixWorldNeedsUpdate = true;
  }

  /** Takes box_from_transducer of the picture that is shown: where it was made, also when it is frozen. */
  placePicture(boxFromTransducer: Matrix4): void {
    this.fan.matrix.copy(boxFromTransducer);
    this.fan.matrixWorldNeedsUpdate = true;
  }

  /** Whether there is a beam, a picture in it, and whether it is a prediction. */
  show(visible: boolean, picture: boolean, coasting: boolean): void {
    this.group.visible = visible || picture;
    this.outlined.visible = visible;
    this.fan.visible = picture;
    const colour = coasting ? COLOURS.coasting : COLOURS.tracked;
    this.outline.material.color.setHex(colour);
    this.ball.material.color.setHex(colour);
  }

  dispose(): void {
    this.group.removeFromParent();
    this.fan.material.dispose();
    for (const each of [this.outline, this.ball]) {
      each.geometry.dispose();
      each.material.dispose();
    }
  }
}
