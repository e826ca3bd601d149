/** Keeps the scene's labels from lying over each other: where two would, the more important or nearer one is shown. */

import { Matrix4, Sprite, Vector3 } from "three";
import { LabelCrowd, MOST_LABELS } from "../maths/declutter";
import type { Feature, Frame } from "../stage/feature";
import type { Stage } from "../stage/stage";
import { rankOf } from "./label";

/** Whoever makes and takes away labels counts how often. */
export interface LabelMaker {
  readonly labelsVersion: number;
}

/**
 * Works on labels with a rank, in angles as seen by the viewer: in a headset from between the eyes, once for both. What
 * is not shown fades; the thing that it names, a dot or a tick, stays.
 */
export class Declutter implements Feature {
  private readonly crowd = new LabelCrowd();
  private labels: Sprite[] = [];
  private version = -1;
  private readonly viewFromScene = new Matrix4();
  private readonly at = new Vector3();
  private readonly unit = new Vector3(1, 1, 1);

  constructor(private readonly stage: Stage, private readonly makers: readonly LabelMaker[]) {}

  describe(): void {
    this.version = -1;
  }

  update(frame: Frame): boolean {
    if (this.makersVersion() !== this.version) this.collect();
    if (this.labels.length === 0) return false;
    const { view } = this.stage;
    if (frame.immersive) this.viewFromScene.compose(view.head.position, view.head.orientation, this.unit);
    else this.viewFromScene.copy(view.camera.matrixWorld);
    this.viewFromScene.invert();
    view.box.updateWorldMatrix(true, false);
    const metres = this.at.setFromMatrixColumn(view.box.matrixWorld, 0).length();
    for (let i = 0; i < this.labels.length; i++) this.place(i, this.labels[i]!, metres);
    const changed = this.crowd.settle(frame.dtS);
    if (changed) this.paint();
    return changed;
  }

  private makersVersion(): number {
    let sum = 0;
    for (const maker of this.makers) sum += maker.labelsVersion;
    return sum;
  }

  private collect(): void {
    this.version = this.makersVersion();
    this.labels = [];
    this.stage.view.box.traverse((node) => {
      if (node instanceof Sprite && rankOf(node) !== null && this.labels.length < MOST_LABELS) this.labels.push(node);
    });
    this.labels.forEach((label, i) => (this.crowd.rank[i] = rankOf(label)!));
    this.crowd.restart(this.labels.length);
    this.paint();
  }

  /** Writes where a label is seen. Its parents up to the box are not turned or scaled. */
  private place(i: number, label: Sprite, metres: number): void {
    const { crowd, at } = this;
    label.updateWorldMatrix(true, false);
    at.setFromMatrixPosition(label.matrixWorld).applyMatrix4(this.viewFromScene);
    const distance = -at.z;
    crowd.distance[i] = distance;
    if (distance <= 0) return;
    crowd.x[i] = at.x / distance;
    crowd.y[i] = at.y / distance;
    crowd.halfWidth[i] = 0.5 * metres * label.scale.x;
    crowd.halfHeight[i] = 0.5 * metres * label.scale.y;
  }

  private paint(): void {
    for (let i = 0; i < this.labels.length; i++) {
      const { material } = this.labels[i]!;
      material.opacity = this.crowd.opacity[i]!;
      this.labels[i]!.visible = material.opacity > 0.01;
    }
  }
}
