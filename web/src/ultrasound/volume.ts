/** The acoustic volume on the graphics card: four coded properties of the tissue at every voxel. */

import { ClampToEdgeWrapping, Data3DTexture, LinearFilter, Matrix4, NoColorSpace, RGBAFormat, UnsignedByteType, Vector3 } from "three";

/** How bytes become physical units; see Scales in src/cathxr/ultrasound/field.py. */
export interface AcousticScales {
  readonly scatterMax: number;
  readonly attenuationMaxDbCmMHz: number;
  readonly interfaceMaxPerMm: number;
  readonly interfaceVoxels: number;
}

export const ACOUSTIC_SCALES: AcousticScales = {
  scatterMax: 2.5,
  attenuationMaxDbCmMHz: 20,
  interfaceMaxPerMm: 0.5,
  interfaceVoxels: 2.35,
};

export class AcousticVolume {
  readonly texture: Data3DTexture;
  readonly voxelFromCt = new Matrix4();
  readonly spacingMm = new Vector3();

  /**
   * rgba: (K, J, I, 4) bytes, i fastest. size: I, J, K. ctFromVoxel: 16 numbers row by row, (i, j, k, 1) of a voxel's
   * centre to mm in `ct`. Throws RangeError when the numbers do not fit each other.
   */
  constructor(
    rgba: Uint8Array<ArrayBuffer>,
    readonly size: readonly [number, number, number],
    ctFromVoxel: readonly number[],
    readonly scales: AcousticScales = ACOUSTIC_SCALES,
  ) {
    const [i, j, k] = size;
    if (rgba.length !== 4 * i * j * k) throw new RangeError(`The acoustic volume should have ${4 * i * j * k} bytes and has ${rgba.length}.`);
    if (ctFromVoxel.length !== 16) throw new RangeError("The acoustic volume's ct_from_voxel should have 16 numbers.");
    const ctFrom = new Matrix4().fromArray(ctFromVoxel).transpose();
    if (Math.abs(ctFrom.determinant()) < 1e-9) throw new RangeError("The acoustic volume's ct_from_voxel cannot be inverted.");
    this.voxelFromCt.copy(ctFrom).invert();
    const axis = new Vector3();
    this.spacingMm.set(
      axis.setFromMatrixColumn(ctFrom, 0).length(),
      axis.setFromMatrixColumn(ctFrom, 1).length(),
      axis.setFromMatrixColumn(ctFrom, 2).length(),
    );
    this.texture = new Data3DTexture(rgba, i, j, k);
    this.texture.format = RGBAFormat;
    this.texture.type = UnsignedByteType;
    this.texture.colorSpace = NoColorSpace;
    this.texture.minFilter = this.texture.magFilter = LinearFilter;
    this.texture.wrapS = this.texture.wrapT = this.texture.wrapR = ClampToEdgeWrapping;
    this.texture.unpackAlignment = 1;
    this.texture.needsUpdate = true;
  }

  /** How wide the volume's smoothing has made an interface, mm. */
  get interfaceMm(): number {
    const { x, y, z } = this.spacingMm;
    return (this.scales.interfaceVoxels * (x + y + z)) / 3;
  }

  dispose(): void {
    this.texture.dispose();
  }
}
