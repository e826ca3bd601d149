/** From the box to the heart: where a registration says that the one lies in the other. */

import { Matrix4, Quaternion, Vector3 } from "three";
import type { RegistrationDescription } from "../generated/messages";

/** Writes the transform from mm in `box` to mm in `ct`: with its scale, or with the linear part of an affinity. */
export function ctFromBox(out: Matrix4, registration: RegistrationDescription): Matrix4 {
  const { rotation_wxyz, translation_mm } = registration.ct_from_box;
  const { scale, linear } = registration;
  if (linear != null) {
    const [[a, b, c], [d, e, f], [g, h, i]] = linear;
    const [x, y, z] = translation_mm;
    return out.set(a, b, c, x, d, e, f, y, g, h, i, z, 0, 0, 0, 1);
  }
  const [w, x, y, z] = rotation_wxyz;
  return out.compose(new Vector3(...translation_mm), new Quaternion(x, y, z, w), new Vector3(scale, scale, scale));
}

/** Writes the transform from glTF's metres (x, z, -y of `ct`) to mm in `box`. */
export function boxFromGltf(out: Matrix4, registration: RegistrationDescription): Matrix4 {
  const ctFromGltf = new Matrix4().set(1000, 0, 0, 0, 0, 0, -1000, 0, 0, 1000, 0, 0, 0, 0, 0, 1);
  return ctFromBox(out, registration).invert().multiply(ctFromGltf);
}
