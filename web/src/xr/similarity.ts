/** A place, a turn and a size: how the world stands in the room, and how a hand stands in it. */

import type { Object3D } from "three";
import { Quaternion, Vector3 } from "three";

const work = { vector: new Vector3(), quaternion: new Quaternion() };

/** x_outer = position + scale * orientation * x_inner. Metres. Methods change it in place and return it. */
export class Similarity {
  readonly position = new Vector3();
  readonly orientation = new Quaternion();
  scale = 1;

  copy(other: Similarity): this {
    this.position.copy(other.position);
    this.orientation.copy(other.orientation);
    this.scale = other.scale;
    return this;
  }

  set(position: Vector3, orientation: Quaternion, scale = 1): this {
    this.position.copy(position);
    this.orientation.copy(orientation);
    this.scale = scale;
    return this;
  }

  identity(): this {
    this.position.set(0, 0, 0);
    this.orientation.identity();
    this.scale = 1;
    return this;
  }

  /** Becomes this ∘ inner: first inner, then this. */
  multiply(inner: Similarity): this {
    work.vector.copy(inner.position);
    this.apply(work.vector);
    this.position.copy(work.vector);
    this.orientation.multiply(inner.orientation).normalize();
    this.scale *= inner.scale;
    return this;
  }

  invert(): this {
    this.orientation.conjugate();
    this.scale = 1 / this.scale;
    this.position.applyQuaternion(this.orientation).multiplyScalar(-this.scale);
    return this;
  }

  /** Turns an inner point into the outer one, in place. */
  apply(point: Vector3): Vector3 {
    return point.applyQuaternion(this.orientation).multiplyScalar(this.scale).add(this.position);
  }

  /** Turns an outer point into the inner one, in place. */
  applyInverse(point: Vector3): Vector3 {
    work.quaternion.copy(this.orientation).conjugate();
    return point.sub(this.position).applyQuaternion(work.quaternion).divideScalar(this.scale);
  }

  /** Moves it so that the inner point comes to lie at the outer one. */
  pin(inner: Vector3, outer: Vector3): this {
    work.vector.copy(inner).applyQuaternion(this.orientation).multiplyScalar(this.scale);
    this.position.subVectors(outer, work.vector);
    return this;
  }

  /** Becomes what lies at `share` (0 to 1) of the way from one to another; sizes in equal ratios. */
  between(from: Similarity, to: Similarity, share: number): this {
    this.orientation.slerpQuaternions(from.orientation, to.orientation, share);
    this.scale = from.scale * (to.scale / from.scale) ** share;
    this.position.lerpVectors(from.position, to.position, share);
    return this;
  }

  writeTo(object: Object3D): void {
    object.position.copy(this.position);
    object.quaternion.copy(this.orientation);
    object.scale.setScalar(this.scale);
    object.updateMatrix();
    object.matrixWorldNeedsUpdate = true;
  }
}
