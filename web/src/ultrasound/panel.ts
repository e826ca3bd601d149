/** The ultrasound machine's screen: the picture on a dark plate, with what stands around it. */

import { CanvasTexture, Group, LinearFilter, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace } from "three";
import { annotate, layout } from "./annotations";
import type { Layout, PanelState } from "./annotations";
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
  /** Why there is no picture, in words; empty: there is one. */
  message = "";
  /** Names and colours of what the fan colours; give another array to change it. */
  legend: PanelState["legend"] = [];
  /** How many times as large as usual the text is: more where the panel is shown small. */
  textScale = 1;
  readonly heightM: number;
  private readonly context: CanvasRenderingContext2D;
  private readonly texture: CanvasTexture;
  private readonly parts: Mesh<PlaneGeometry, MeshBasicMaterial>[];
  private readonly drawn = {
    settings: null as IceSettings | null, frozen: false, hz: 0, distalLeft: true, message: "", legend: this.legend, textScale: 1,
  };

  /** geometry: to be shared with the beam's fan. Throws Error when the browser gives no 2D canvas. */
  constructor(private readonly imager: IceImager, geometry?: FanGeometry, readonly widthM = 0.4) {
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
    this.heightM = (widthM * HEIGHT) / WIDTH;
    const shape = new PlaneGeometry(widthM, this.heightM);
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

  /**
   * Follows the imager's settings; returns whether anything has changed. May be called for every frame: it does nothing
   * when nothing has.
   */
  refresh(): boolean {
    const { settings, frozen, hz } = this.imager;
    const { drawn, message, legend, textScale } = this;
    if (settings === drawn.settings && frozen === drawn.frozen && hz === drawn.hz && this.distalLeft === drawn.distalLeft
      && message === drawn.message && legend === drawn.legend && textScale === drawn.textScale) return false;
    drawn.settings = settings;
    drawn.frozen = frozen;
    drawn.hz = hz;
    drawn.distalLeft = this.distalLeft;
    drawn.message = message;
    drawn.legend = legend;
    drawn.textScale = textScale;
    const [width, height] = [WIDTH / textScale, HEIGHT / textScale];
    const at = layout(settings, width, height, this.distalLeft);
    this.context.setTransform(textScale, 0, 0, textScale, 0, 0);
    annotate(this.context, settings, at, drawn, width, height);
    this.texture.needsUpdate = true;
    this.fan.visible = message === "";
    this.fan.fit();
    this.place(at, width, height);
    return true;
  }

  /** Lays the fan where the scale and the marks expect it. */
  private place(at: Layout, width: number, height: number): void {
    const metres = this.widthM / width;
    const scale = metres * at.pxPerMm;
    // The picture's x goes down and its z to the distal side: columns are where transducer x, y and z go.
    this.fan.matrixAutoUpdate = false;
    this.fan.matrix.set(
      0, 0, at.distal * scale, (at.x - width / 2) * metres,
      -scale, 0, 0, (height / 2 - at.y) * metres,
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
