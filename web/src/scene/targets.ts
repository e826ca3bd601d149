/** Places to reach, as see-through balls with their names. */

import { Group, Mesh, MeshStandardMaterial, SphereGeometry } from "three";
import type { TargetDescription } from "../generated/messages";
import { makeLabel } from "./label";

/** Returns the drawing of all targets, in `box` mm; not shown yet: many names at once hide what they name. */
export function makeTargets(targets: readonly TargetDescription[]): Group {
  const group = new Group();
  group.name = "targets";
  group.visible = false;
  for (const target of targets) {
    const material = new MeshStandardMaterial({ color: 0xffd166, transparent: true, opacity: 0.45, depthWrite: false });
    const ball = new Mesh(new SphereGeometry(target.radius_mm, 24, 16), material);
    ball.position.set(...target.position_mm);
    ball.renderOrder = 30;
    const label = makeLabel(target.name.replaceAll("_", " "), "#ffd166");
    label.position.set(target.position_mm[0], target.position_mm[1], target.position_mm[2] + target.radius_mm + 4);
    group.add(ball, label);
  }
  return group;
}
