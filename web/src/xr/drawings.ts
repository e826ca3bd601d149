/** Controllers, bare hands, rays and cursors: own simple shapes, nothing loaded, three draw calls for all of them. */

import type { Object3D, Scene } from "three";
import {
  BufferGeometry, CapsuleGeometry, Color, CylinderGeometry, DynamicDrawUsage, Float32BufferAttribute, InstancedMesh, LatheGeometry,
  Matrix4, Mesh, MeshLambertMaterial, Quaternion, RingGeometry, ShaderMaterial, SphereGeometry, TorusGeometry, Vector2, Vector3, Vector4,
} from "three";
import { mergeGeometries } from "three/addons/utils/BufferGeometryUtils.js";
import { PLATE_ORDER } from "./canvas_plate";
import type { Hit } from "./hits";
import type { Pointer } from "./pointer";

const FINGERS = ["thumb", "index-finger", "middle-finger", "ring-finger", "pinky-finger"] as const;
const PARTS = ["metacarpal", "phalanx-proximal", "phalanx-intermediate", "phalanx-distal", "tip"] as const;
const JOINTS = ["wrist", ...FINGERS.flatMap((finger) => PARTS.map((part) => `${finger}-${part}`))].filter(
  (name) => name !== "thumb-phalanx-intermediate",
) as XRHandJoint[];
/** Each joint's neighbour towards the wrist: the bones between them. */
const BONES = JOINTS.slice(1).map((name, index) => [name.endsWith("metacarpal") ? "wrist" as XRHandJoint : JOINTS[index]!, name] as const);
const SKIN = new Color(0x9fb6cc);
const CASE = new Color(0x55667a);
const HELD = new Color(0x3ddc8c);
const PRESSED = new Vector4(0.07, 1, 0.34, 1);
const POINTING = new Vector4(1, 1, 1, 0.95);
const RAY = new Vector4(0.52, 0.69, 1, 0.6);
const RAY_RADIUS_M = 0.0009;
/** A cursor floats this far before its plate. */
const LIFT_M = 0.002;
/** A cursor is as large in the eye from farther away. */
const CURSOR_AT_M = 0.6;
const UP = new Vector3(0, 1, 0);
const NONE = new Matrix4().makeScale(0, 0, 0);
const work = {
  matrix: new Matrix4(), a: new Vector3(), b: new Vector3(), turn: new Quaternion(), size: new Vector3(), normal: new Vector3(),
};

/** What each hand does now. */
export interface HandState {
  hitOf(pointer: Pointer): Hit;
  grabs(pointer: Pointer): boolean;
}

export class HandDrawings {
  private readonly controllers = instances(controllerShape(), 0x202a36, 2);
  private readonly bones = instances(boneShape(), 0x1a2430, 2 * BONES.length);
  readonly marks = new Marks();
  /** Whether a bare hand is where it was last drawn; else its bones have to be put away first. */
  private readonly posed = [true, true];

  constructor(private readonly pointers: readonly [Pointer, Pointer], scene: Scene) {
    this.controllers.name = "controllers";
    this.bones.name = "hands";
    for (const pointer of pointers) scene.add(pointer.ray, pointer.grip, pointer.hand);
    scene.add(this.controllers, this.bones, this.marks.mesh);
  }

  /** Called once a frame while a session runs. */
  update(state: HandState): void {
    let [held, bare] = [false, false];
    for (let side = 0; side < 2; side++) {
      const pointer = this.pointers[side]!;
      const holding = state.grabs(pointer);
      const shown = pointer.tracked;
      const holds = shown && !pointer.bare && pointer.grip.visible;
      held ||= holds;
      bare ||= shown && pointer.bare;
      this.controllers.setMatrixAt(side, holds ? pointer.grip.matrix : NONE);
      this.controllers.setColorAt(side, holding ? HELD : CASE);
      this.poseHand(side, shown && pointer.bare ? pointer : null, holding ? HELD : SKIN);
      this.marks.point(side, pointer, shown && !holding ? state.hitOf(pointer) : null);
    }
    this.controllers.visible = held;
    this.bones.visible = bare;
    this.controllers.instanceMatrix.needsUpdate = true;
    this.controllers.instanceColor!.needsUpdate = true;
    this.marks.finish();
  }

  hide(): void {
    this.controllers.visible = this.bones.visible = this.marks.mesh.visible = false;
  }

  private poseHand(side: number, pointer: Pointer | null, colour: Color): void {
    if (pointer === null && !this.posed[side]) return;
    this.posed[side] = pointer !== null;
    this.bones.instanceMatrix.needsUpdate = true;
    this.bones.instanceColor!.needsUpdate = true;
    for (let index = 0; index < BONES.length; index++) {
      const slot = side * BONES.length + index;
      const [from, to] = BONES[index]!;
      const matrix = pointer === null ? NONE
        : boneMatrix(pointer.hand.joints[from] as JointGroup | undefined, pointer.hand.joints[to] as JointGroup | undefined);
      this.bones.setMatrixAt(slot, matrix);
      this.bones.setColorAt(slot, colour);
    }
  }
}

/** Two rays and two cursors in one draw call: each piece has a pose and a colour of its own. */
class Marks {
  readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  /** Ray, cursor; left, right: as `piece` counts them. */
  private readonly poses = [new Matrix4(), new Matrix4(), new Matrix4(), new Matrix4()] as const;
  private readonly colours = [RAY.clone(), RAY.clone(), POINTING.clone(), POINTING.clone()] as const;
  private shown = false;

  constructor() {
    this.mesh = new Mesh(markShape(), new ShaderMaterial({
      vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: { poses: { value: this.poses }, colours: { value: this.colours } },
      transparent: true, depthWrite: false,
    }));
    this.mesh.name = "rays and cursors";
    this.mesh.frustumCulled = this.mesh.visible = false;
    this.mesh.renderOrder = PLATE_ORDER + 6;
  }

  /** hit: what a hand points at; null: nothing is to be drawn of it. */
  point(side: number, pointer: Pointer, hit: Hit | null): void {
    const ray = this.poses[side]!;
    const cursor = this.poses[2 + side]!;
    const aims = hit !== null && hit.plate !== null;
    if (!aims || hit.touching) ray.copy(NONE);
    else ray.copy(pointer.ray.matrix).scale(work.size.set(1, 1, Math.max(0.01, hit.distance)));
    if (!aims) {
      cursor.copy(NONE);
      return;
    }
    this.shown = true;
    hit.plate!.group.getWorldQuaternion(work.turn);
    work.normal.set(0, 0, 1).applyQuaternion(work.turn);
    work.a.copy(hit.point).addScaledVector(work.normal, LIFT_M);
    cursor.compose(work.a, work.turn, work.size.setScalar(hit.touching ? 1 : Math.max(1, hit.distance / CURSOR_AT_M)));
    this.colours[2 + side]!.copy(pointer.selecting ? PRESSED : POINTING);
  }

  finish(): void {
    this.mesh.visible = this.shown;
    this.shown = false;
  }
}

type JointGroup = Object3D & { readonly jointRadius?: number };

function radiusOf(joint: JointGroup): number {
  return 0.92 * (joint.jointRadius ?? 0.008);
}

function boneMatrix(from: JointGroup | undefined, to: JointGroup | undefined): Matrix4 {
  if (from?.visible !== true || to?.visible !== true) return NONE;
  work.a.subVectors(to.position, from.position);
  const length = work.a.length();
  if (length < 1e-6) return NONE;
  work.turn.setFromUnitVectors(UP, work.a.divideScalar(length));
  work.b.addVectors(from.position, to.position).multiplyScalar(0.5);
  const radius = 0.95 * Math.min(radiusOf(from), radiusOf(to));
  return work.matrix.compose(work.b, work.turn, work.size.set(radius, length, radius));
}

function instances(geometry: BufferGeometry, emissive: number, count: number): InstancedMesh {
  const mesh = new InstancedMesh(geometry, new MeshLambertMaterial({ color: 0xffffff, emissive }), count);
  for (let slot = 0; slot < count; slot++) mesh.setColorAt(slot, SKIN);
  mesh.instanceMatrix.setUsage(DynamicDrawUsage);
  mesh.frustumCulled = mesh.visible = false;
  return mesh;
}

/** A bone 1 long and 1 thick to each side, with round ends that overlap with the next bone's. */
function boneShape(): BufferGeometry {
  const [ends, cap] = [4, 0.26];
  const outline: Vector2[] = [];
  for (const sign of [-1, 1]) {
    for (let step = 0; step <= ends; step++) {
      const angle = ((sign < 0 ? ends - step : step) / ends) * (Math.PI / 2);
      outline.push(new Vector2(Math.max(1e-4, Math.cos(angle)), sign * (0.5 + cap * Math.sin(angle))));
    }
  }
  return new LatheGeometry(outline, 10);
}

/** A handle, a ring before it and a trigger, in the grip's frame: -z points away from the hand's little finger. */
function controllerShape(): BufferGeometry {
  const handle = new CapsuleGeometry(0.016, 0.075, 4, 12).rotateX(Math.PI / 2).translate(0, -0.004, 0.02);
  const head = new SphereGeometry(0.024, 14, 10).scale(1, 0.72, 1.1).translate(0, 0.004, -0.034);
  const ring = new TorusGeometry(0.034, 0.0045, 6, 24).rotateX(Math.PI / 2.3).translate(0, 0.012, -0.045);
  const trigger = new CapsuleGeometry(0.006, 0.012, 3, 8).rotateX(Math.PI / 2).translate(0, -0.014, -0.046);
  return merged([handle, head, ring, trigger]);
}

function markShape(): BufferGeometry {
  const pieces = [0, 1, 2, 3].map((piece) => {
    const shape = piece < 2
      ? new CylinderGeometry(0.4 * RAY_RADIUS_M, RAY_RADIUS_M, 1, 5, 1, true).translate(0, 0.5, 0).rotateX(-Math.PI / 2)
      : new RingGeometry(0.003, 0.0055, 20);
    shape.setAttribute("piece", new Float32BufferAttribute(new Float32Array(shape.getAttribute("position").count).fill(piece), 1));
    return shape;
  });
  return merged(pieces);
}

function merged(shapes: readonly BufferGeometry[]): BufferGeometry {
  const whole = mergeGeometries(shapes.map((each) => each.toNonIndexed()));
  if (whole === null) throw new Error("Shapes that are to be drawn as one do not fit together.");
  return whole;
}

const VERTEX = `
attribute float piece;
uniform mat4 poses[4];
uniform vec4 colours[4];
varying vec4 colour;
void main() {
  int which = int(piece + 0.5);
  colour = colours[which];
  gl_Position = projectionMatrix * viewMatrix * poses[which] * vec4(position, 1.0);
}`;

const FRAGMENT = `
varying vec4 colour;
void main() {
  gl_FragColor = colour;
  #include <colorspace_fragment>
}`;
