/** The structures' label at every voxel, and their colours, for the teaching overlay. */

import {
  ClampToEdgeWrapping, Color, Data3DTexture, DataTexture, Matrix4, NearestFilter, NoColorSpace,
  RedIntegerFormat, SRGBColorSpace, UnsignedByteType,
} from "three";

export class LabelVolume {
  readonly texture: Data3DTexture;
  readonly palette: DataTexture;
  readonly voxelFromCt = new Matrix4();

  /**
   * labels: (K, J, I) bytes, i fastest. size: I, J, K. ctFromVoxel: 16 numbers row by row. colours: "#rrggbb" by label;
   * a label without a colour is not coloured. Throws RangeError when the numbers do not fit each other.
   */
  constructor(
    labels: Uint8Array<ArrayBuffer>,
    size: readonly [number, number, number],
    ctFromVoxel: readonly number[],
    colours: ReadonlyMap<number, string>,
  ) {
    const [i, j, k] = size;
    if (labels.length !== i * j * k) throw new RangeError(`The label volume should have ${i * j * k} bytes and has ${labels.length}.`);
    if (ctFromVoxel.length !== 16) throw new RangeError("The label volume's ct_from_voxel should have 16 numbers.");
    this.voxelFromCt.fromArray(ctFromVoxel).transpose().invert();
    this.texture = new Data3DTexture(labels, i, j, k);
    this.texture.format = RedIntegerFormat;
    this.texture.type = UnsignedByteType;
    this.texture.internalFormat = "R8UI";
    this.texture.colorSpace = NoColorSpace;
    this.texture.minFilter = this.texture.magFilter = NearestFilter;
    this.texture.wrapS = this.texture.wrapT = this.texture.wrapR = ClampToEdgeWrapping;
    this.texture.unpackAlignment = 1;
    this.texture.needsUpdate = true;
    this.palette = new DataTexture(paletteOf(colours), 256, 1);
    this.palette.colorSpace = NoColorSpace;
    this.palette.needsUpdate = true;
  }

  dispose(): void {
    this.texture.dispose();
    this.palette.dispose();
  }
}

/** The picture goes to the screen as it is, so that the colours are kept as the screen's own numbers. */
function paletteOf(colours: ReadonlyMap<number, string>): Uint8Array<ArrayBuffer> {
  const bytes = new Uint8Array(4 * 256);
  const colour = new Color();
  for (const [label, text] of colours) {
    if (label < 0 || label > 255) throw new RangeError(`label: expected 0 to 255, got ${label}`);
    colour.setStyle(text, SRGBColorSpace);
    const rgb = colour.getRGB({ r: 0, g: 0, b: 0 }, SRGBColorSpace);
    bytes.set([255 * rgb.r, 255 * rgb.g, 255 * rgb.b, 255].map(Math.round), 4 * label);
  }
  return bytes;
}
