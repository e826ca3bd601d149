/** The view from the tip as a plate. */

import { Color, Group, Mesh, MeshBasicMaterial, PlaneGeometry } from "three";
import type { TipView } from "../scene/endoscope";
import type { Plate } from "./plate";

const WIDTH_M = 0.4;
const ORDER = 60;
const NOTHING = new Color(0x0a0e14);
const WHITE = new Color(0xffffff);

export class EndoscopePlate implements Plate {
  readonly group = new Group();
  readonly widthM = WIDTH_M;
  readonly heightM: number;
  readonly title = "View from the tip";
  private readonly mesh: Mesh<PlaneGeometry, MeshBasicMaterial>;

  constructor(private readonly picture: TipView) {
    this.heightM = WIDTH_M / picture.aspect;
    this.mesh = new Mesh(new PlaneGeometry(WIDTH_M, this.heightM), new MeshBasicMaterial({ map: picture.texture, toneMapped: false }));
    this.mesh.renderOrder = ORDER;
    this.group.name = this.title;
    this.group.add(this.mesh);
  }

  /** Follows whether there is a picture; a dark plate stands for none. */
  refresh(): void {
    this.mesh.material.color.copy(this.picture.active ? WHITE : NOTHING);
  }

  dispose(): void {
    this.group.removeFromParent();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }
}
