/** The ultrasound machine's screen: the picture on a dark plate, with what stands around it. */

import { CanvasTexture, Group, LinearFilter, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace } from "three";
import { annotate, layout } from "./annotations";
import { IceFan } from "./fan";
import type { FanGeometry } from "./fan";
import type { IceImager } from "./imager";
import type { IceSettings } from "./settings";

const WIDTH = 800;
const HEIGHT = 600;

/**
 * A plate of `widthM` metres, in its own x-y plane, facing z; put its group anywhere. Three draw calls. The text is
 * drawn again only when it changes.
 */
export class IcePanel {
  readonly group = new Group();
  readonly fan: IceFan;
  /** Whether distal is on the left, as the machines have it until it is turned. */
  distalLeft = true;
  private readonly context: CanvasRenderingContext2D;
  private readonly texture: CanvasTexture;
  private readonly parts: Mesh<PlaneGeometry, MeshBasicMaterial>[];
  private readonly drawn = { settings: null as IceSettings | null, frozen: false, hz: 0, distalLeft: true };

  /** geometry: to be shared with the beam's fan. Throws Error when the browser gives no 2D canvas. */
  constructor(private readonly imager: IceImager, geometry?: FanGeometry, private readonly widthM = 0.4) {
    const canvas = document.createElement("canvas");
    canvas.width = WIDTH;
    canvas.height = HEIGHT;
    const context = canvas.getContext("2d");
    if (context === null) throw new Error("This browser gives no 2D canvas.");
    this.context = context;
    this.texture = new CanvasTexture(canvas);
    this.texture.colorSpace = SRGBColorSpace;
    this.texture.minFilter = LinearFilter;
    this.texture.generateMipmaps = false;
    const shape = new PlaneGeometry(widthM, (widthM * HEIGHT) / WIDTH);
    const plate = new Mesh(shape, new MeshBasicMaterial({ color: 0x05080c }));
    const text = new Mesh(shape, new MeshBasicMaterial({ map: this.texture, transparent: true, depthWrite: false }));
    this.fan = new IceFan(imager, geometry);
    this.parts = [plate, text];
    plate.renderOrder = 60;
    this.fan.renderOrder = 61;
    text.renderOrder = 62;
    text.position.z = 0.002;
    this.group.name = "ice panel";
    this.group.add(plate, this.fan, text);
    this.refresh();
  }

  /** Follows the imager's settings; may be called for every frame: it does nothing when nothing has changed. */
  refresh(): void {
    const { settings, frozen, hz } = this.imager;
    const { drawn } = this;
    if (settings === drawn.settings && frozen === drawn.frozen && hz === drawn.hz && this.distalLeft === drawn.distalLeft) return;
    drawn.settings = settings;
    drawn.frozen = frozen;
    drawn.hz = hz;
    drawn.distalLeft = this.distalLeft;
    const at = layout(settings, WIDTH, HEIGHT, this.distalLeft);
    annotate(this.context, settings, at, { frozen, hz });
    this.texture.needsUpdate = true;
    this.fan.fit();
    const metres = this.widthM / WIDTH;
    const scale = metres * at.pxPerMm;
    // The picture's x goes down and its z to the distal side: columns are where transducer x, y and z go.
    this.fan.matrixAutoUpdate = false;
    this.fan.matrix.set(
      0, 0, at.distal * scale, (at.x - WIDTH / 2) * metres,
      -scale, 0, 0, (HEIGHT / 2 - at.y) * metres,
      0, scale, 0, 0.001,
      0, 0, 0, 1,
    );
    this.fan.matrixWorldNeedsUpdate = true;
  }

  dispose(): void {
    this.fan.dispose();
    this.texture.dispose();
    for (const part of this.parts) {
      part.geometry.dispose();
      part.material.dispose();
    }
  }
}
