/** Controllers, bare hands, rays and cursors: own simple shapes, nothing loaded, few draw calls. */

import type { Object3D, Scene } from "three";
import {
  BufferGeometry, CapsuleGeometry, CylinderGeometry, DynamicDrawUsage, Float32BufferAttribute, InstancedMesh, Line,
  LineBasicMaterial, Matrix4, Mesh, MeshBasicMaterial, MeshLambertMaterial, Quaternion, RingGeometry, SphereGeometry, TorusGeometry, Vector3,
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
const SKIN = 0x9fb6cc;
const HELD = 0x4dff9e;
const UP = new Vector3(0, 1, 0);
const work = { matrix: new Matrix4(), a: new Vector3(), b: new Vector3(), turn: new Quaternion(), size: new Vector3() };
const NONE = new Matrix4().makeScale(0, 0, 0);

/** What is drawn of one of the viewer's hands. */
export class HandDrawing {
  private readonly controller: Mesh<BufferGeometry, MeshLambertMaterial>;
  private readonly skin = new MeshLambertMaterial({ color: SKIN, emissive: 0x1a2430 });
  private readonly joints: InstancedMesh;
  private readonly bones: InstancedMesh;
  private readonly ray: Line;
  private readonly cursor: Mesh<BufferGeometry, MeshBasicMaterial>;

  constructor(private readonly pointer: Pointer, scene: Scene) {
    this.controller = new Mesh(controllerShape(), new MeshLambertMaterial({ color: 0x55667a, emissive: 0x10161e }));
    pointer.grip.add(this.controller);
    this.joints = instances(new SphereGeometry(1, 10, 8), this.skin, JOINTS.length);
    this.bones = instances(new CylinderGeometry(1, 1, 1, 8, 1, true), this.skin, BONES.length);
    const line = new BufferGeometry();
    line.setAttribute("position", new Float32BufferAttribute([0, 0, 0, 0, 0, -1], 3));
    this.ray = new Line(line, new LineBasicMaterial({ color: 0xbfd8ff, transparent: true, opacity: 0.55, depthWrite: false }));
    this.ray.renderOrder = PLATE_ORDER + 5;
    this.ray.visible = false;
    pointer.ray.add(this.ray);
    this.cursor = new Mesh(
      new RingGeometry(0.003, 0.0055, 20),
      new MeshBasicMaterial({ color: 0xffffff, depthTest: false, transparent: true, toneMapped: false }),
    );
    this.cursor.renderOrder = PLATE_ORDER + 6;
    this.cursor.visible = false;
    scene.add(pointer.ray, pointer.grip, pointer.hand, this.joints, this.bones, this.cursor);
  }

  /** Called once a frame while a session runs. hit: what it points at; holding: whether it holds the world. */
  update(hit: Hit, holding: boolean): void {
    const { pointer } = this;
    const shown = pointer.tracked;
    const bare = shown && pointer.bare;
    this.joints.visible = this.bones.visible = bare;
    if (bare) this.poseHand();
    (bare ? this.skin : this.controller.material).emissive.setHex(holding ? 0x1c6b42 : bare ? 0x1a2430 : 0x10161e);
    const aims = shown && !holding && hit.plate !== null;
    this.ray.visible = aims && !hit.touching;
    if (this.ray.visible) this.ray.scale.z = Math.max(0.01, hit.distance);
    this.cursor.visible = aims;
    if (!aims) return;
    this.cursor.position.copy(hit.point);
    hit.plate!.group.getWorldQuaternion(this.cursor.quaternion);
    this.cursor.material.color.setHex(pointer.selecting ? HELD : 0xffffff);
  }

  hide(): void {
    this.joints.visible = this.bones.visible = this.ray.visible = this.cursor.visible = false;
  }

  private poseHand(): void {
    const { joints } = this.pointer.hand;
    for (let index = 0; index < JOINTS.length; index++) {
      const joint = joints[JOINTS[index]!] as JointGroup | undefined;
      if (joint?.visible !== true) this.joints.setMatrixAt(index, NONE);
      else this.joints.setMatrixAt(index, work.matrix.compose(joint.position, joint.quaternion, work.size.setScalar(radiusOf(joint))));
    }
    for (let index = 0; index < BONES.length; index++) {
      const [from, to] = BONES[index]!;
      this.bones.setMatrixAt(index, boneMatrix(joints[from] as JointGroup | undefined, joints[to] as JointGroup | undefined));
    }
    this.joints.instanceMatrix.needsUpdate = this.bones.instanceMatrix.needsUpdate = true;
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
  const radius = 0.9 * Math.min(radiusOf(from), radiusOf(to));
  return work.matrix.compose(work.b, work.turn, work.size.set(radius, length, radius));
}

function instances(geometry: BufferGeometry, material: MeshLambertMaterial, count: number): InstancedMesh {
  const mesh = new InstancedMesh(geometry, material, count);
  mesh.instanceMatrix.setUsage(DynamicDrawUsage);
  mesh.frustumCulled = false;
  mesh.visible = false;
  return mesh;
}

/** A handle, a ring before it and a trigger, in the grip's frame: -z points away from the hand's little finger. */
function controllerShape(): BufferGeometry {
  const handle = new CapsuleGeometry(0.016, 0.075, 4, 12).rotateX(Math.PI / 2).translate(0, -0.004, 0.02);
  const head = new SphereGeometry(0.024, 14, 10).scale(1, 0.72, 1.1).translate(0, 0.004, -0.034);
  const ring = new TorusGeometry(0.034, 0.0045, 6, 24).rotateX(Math.PI / 2.3).translate(0, 0.012, -0.045);
  const trigger = new CapsuleGeometry(0.006, 0.012, 3, 8).rotateX(Math.PI / 2).translate(0, -0.014, -0.046);
  const whole = mergeGeometries([handle, head, ring, trigger].map((each) => each.toNonIndexed()));
  if (whole === null) throw new Error("The controller's shapes do not fit together.");
  return whole;
}
