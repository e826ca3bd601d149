/** Works the distances to the wall out, apart from the page, so that no frame is lost. */

import { distanceField } from "../maths/distance_field";
import type { Voxels } from "../maths/distance_field";

addEventListener("message", (event: MessageEvent<Voxels>) => {
  const field = distanceField(event.data);
  postMessage(field, { transfer: [field.mm.buffer] });
});
