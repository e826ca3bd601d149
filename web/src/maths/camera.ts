/** OpenCV's pinhole camera with distortion k1 k2 p1 p2 k3: from `box` (mm) to raw picture pixels. */

import type { CameraDescription } from "../generated/messages";
import { rotationInto } from "./pose";

/** Projects points without allocating: made once for each camera. Pixel (0, 0) is the first pixel's centre. */
export class CameraModel {
  readonly width: number;
  readonly height: number;
  private readonly rotation = new Float64Array(9);
  private readonly description: CameraDescription;

  constructor(description: CameraDescription) {
    this.description = description;
    [this.width, this.height] = description.size_px;
    rotationInto(this.rotation, description.camera_from_box.rotation_wxyz);
  }

  /**
   * Returns whether the point (x, y, z), mm in `box`, lies in front of the camera, and if so writes its raw pixel to
   * out[at], out[at + 1].
   */
  projectInto(out: Float64Array, at: number, x: number, y: number, z: number): boolean {
    const r = this.rotation as unknown as readonly number[] as Nine;
    const [tx, ty, tz] = this.description.camera_from_box.translation_mm;
    const depth = r[6] * x + r[7] * y + r[8] * z + tz;
    if (!(depth > 0)) return false;
    const a = (r[0] * x + r[1] * y + r[2] * z + tx) / depth;
    const b = (r[3] * x + r[4] * y + r[5] * z + ty) / depth;
    const [k1, k2, p1, p2, k3] = this.description.distortion;
    const squared = a * a + b * b;
    const radial = 1 + squared * (k1 + squared * (k2 + squared * k3));
    const [fx, fy] = this.description.focal_px;
    const [cx, cy] = this.description.centre_px;
    out[at] = fx * (a * radial + 2 * p1 * a * b + p2 * (squared + 2 * a * a)) + cx;
    out[at + 1] = fy * (b * radial + p1 * (squared + 2 * b * b) + 2 * p2 * a * b) + cy;
    return true;
  }
}

type Nine = readonly [number, number, number, number, number, number, number, number, number];
