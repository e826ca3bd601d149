/** The page's camera while it follows another person's head, and its way back to where its own viewer stood. */

import { Matrix4, Quaternion, Vector3 } from "three";
import type { HeadPose } from "../generated/messages";
import type { View } from "../scene/view";
import type { Feature, Frame } from "../stage/feature";
import { Glide } from "./glide";

const STIFFNESS = 14;
/** How far ahead of the eyes the view's turning point lies, m. */
const AHEAD_M = 0.25;
/** A headset shows far more than a page's camera, degrees: with this much the page has what its wearer looks at. */
const HEADSET_FIELD_DEG = 52;

export class Mirror implements Feature {
  private state: "own" | "following" | "returning" = "own";
  private readonly glide = new Glide(STIFFNESS);
  private readonly own = { position: new Vector3(), orientation: new Quaternion(), target: new Vector3(), field: 0 };
  private readonly pose = new Matrix4();
  private readonly local = new Matrix4();
  private readonly position = new Vector3();
  private readonly orientation = new Quaternion();
  private readonly scale = new Vector3();
  private readonly forward = new Vector3();
  private readonly one = new Vector3(1, 1, 1);

  constructor(private readonly view: View) {
    view.controls.addEventListener("start", () => {
      if (this.state === "returning") this.arrive(false); // the viewer takes over on the way
    });
  }

  /** Looks where another one looks; `headset`: who wears one sees a wider picture. Nothing moves in a headset. */
  aim(head: HeadPose, headset: boolean): void {
    if (this.view.immersive) return;
    if (this.state !== "following") this.begin();
    this.poseInScene(head);
    this.glide.aim(this.position, this.orientation);
    this.setField(headset ? HEADSET_FIELD_DEG : this.own.field);
  }

  /** Goes back to one's own view. */
  release(): void {
    if (this.state !== "following") return;
    this.state = "returning";
    this.glide.aim(this.own.position, this.own.orientation);
    this.view.controls.enabled = true;
    this.setField(this.own.field);
  }

  update(frame: Frame): boolean {
    if (this.state === "own") return false;
    if (frame.immersive) {
      this.arrive(false); // the headset's own view has begun: on the page the camera is not ours
      return false;
    }
    const moving = this.glide.step(frame.dtS);
    this.place();
    if (!moving && this.state === "returning") this.arrive(true);
    return moving;
  }

  private begin(): void {
    const { camera, controls } = this.view;
    controls.dispatchEvent({ type: "start" }); // whatever moves the camera lets go of it
    if (this.state === "own") {
      this.own.position.copy(camera.position);
      this.own.orientation.copy(camera.quaternion);
      this.own.target.copy(controls.target);
      this.own.field = camera.fov;
    }
    this.state = "following";
    this.glide.start(camera.position, camera.quaternion);
    controls.enabled = false;
  }

  /** Puts the camera at the gliding pose, in such a way that the orbit controls leave it there. */
  private place(): void {
    const { camera, controls } = this.view;
    camera.position.copy(this.glide.position);
    camera.up.set(0, 1, 0).applyQuaternion(this.glide.orientation);
    this.forward.set(0, 0, -AHEAD_M).applyQuaternion(this.glide.orientation);
    controls.target.addVectors(camera.position, this.forward);
    camera.quaternion.copy(this.glide.orientation);
  }

  private arrive(exactly: boolean): void {
    const { camera, controls } = this.view;
    this.state = "own";
    controls.enabled = true;
    camera.up.set(0, 1, 0);
    if (exactly) {
      camera.position.copy(this.own.position);
      controls.target.copy(this.own.target);
    }
    this.setField(this.own.field);
  }

  private setField(degrees: number): void {
    const { camera } = this.view;
    if (camera.fov === degrees) return;
    camera.fov = degrees;
    camera.updateProjectionMatrix();
    this.view.touch();
  }

  /** Writes where a head in `box` is in the scene: position, m, and orientation. */
  private poseInScene({ position_mm, orientation_wxyz: [w, x, y, z] }: HeadPose): void {
    this.local.compose(this.position.set(...position_mm), this.orientation.set(x, y, z, w).normalize(), this.one);
    this.view.box.updateWorldMatrix(true, false);
    this.pose.multiplyMatrices(this.view.box.matrixWorld, this.local).decompose(this.position, this.orientation, this.scale);
  }
}
