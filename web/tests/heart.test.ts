import { BackSide, BoxGeometry, FrontSide, Group, Matrix4, Mesh, MeshStandardMaterial, Vector3 } from "three";
import type { Material, Object3D } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { describe, expect, it, vi } from "vitest";
import { boxFromGltf } from "../src/maths/registration";
import { Heart } from "../src/scene/heart";
import { FrameBudget } from "../src/scene/budget";

const UNKNOWN = { linear: null, fre_mm: null, tre_mm: null, predicted_tre_mm: null, worst_tre_mm: null, date: null };

describe("boxFromGltf", () => {
  it("undoes ct_from_box with its scale, and glTF's axes and metres", () => {
    const angle = 0.7;
    const half = angle / 2;
    const registration = {
      ...UNKNOWN, kind: "similarity", scale: 1.25,
      ct_from_box: {
        rotation_wxyz: [Math.cos(half), 0, 0, Math.sin(half)] as [number, number, number, number],
        translation_mm: [10, -20, 30] as [number, number, number],
      },
    };
    const box = new Vector3(41, -7, 12);
    // point_ct = scale R point_box + t, with R a turn about z
    const ct = [
      1.25 * (Math.cos(angle) * box.x - Math.sin(angle) * box.y) + 10,
      1.25 * (Math.sin(angle) * box.x + Math.cos(angle) * box.y) - 20,
      1.25 * box.z + 30,
    ] as const;
    const gltf = new Vector3(ct[0], ct[2], -ct[1]).divideScalar(1000);
    const back = gltf.applyMatrix4(boxFromGltf(new Matrix4(), registration));
    expect(back.distanceTo(box)).toBeLessThan(1e-9);
  });

  it("undoes an affinity by its linear part, and not by the pose and scale nearest to it", () => {
    type Row = [number, number, number];
    const linear: [Row, Row, Row] = [[0.1, -1.2, 0.05], [1.1, 0.2, -0.1], [0.02, 0.1, 0.9]];
    const registration = {
      ...UNKNOWN, kind: "affine", scale: 1.06, linear,
      ct_from_box: { rotation_wxyz: [Math.SQRT1_2, 0, 0, Math.SQRT1_2] as [number, number, number, number], translation_mm: [10, -20, 30] as Row },
    };
    const box = new Vector3(41, -7, 12);
    const [x, y, z] = linear.map((row, i) => row[0] * box.x + row[1] * box.y + row[2] * box.z + [10, -20, 30][i]!) as Row;
    const gltf = new Vector3(x, z, -y).divideScalar(1000);
    expect(gltf.applyMatrix4(boxFromGltf(new Matrix4(), registration)).distanceTo(box)).toBeLessThan(1e-9);
  });
});

/** A file whose part is a mesh of two primitives, which comes out of the loader as a group of two meshes. */
function fileWithCaps(): { scene: Group; walls: BoxGeometry; caps: BoxGeometry } {
  const walls = new BoxGeometry(0.02, 0.03, 0.04);
  const caps = new BoxGeometry(0.01, 0.01, 0.01);
  const part = new Group();
  part.name = "right_atrium";
  part.position.set(0.1, 0.2, 0.3);
  part.add(new Mesh(walls, new MeshStandardMaterial({ name: "right_atrium" })), new Mesh(caps, new MeshStandardMaterial({ name: "caps" })));
  return { scene: new Group().add(part), walls, caps };
}

const DESCRIPTION = {
  glb: "heart.glb",
  parts: [{ key: "right_atrium", name: "Right atrium", node: "right_atrium", colour: "#5fb0d0", opacity: 0.3 }],
  registration: {
    kind: "placement", fre_mm: null, tre_mm: null, scale: 1,
    ct_from_box: { rotation_wxyz: [1, 0, 0, 0], translation_mm: [0, 0, 0] },
  },
};

async function loaded(material: "lambert" | "standard"): Promise<{ heart: Heart; walls: BoxGeometry; caps: BoxGeometry }> {
  const { scene, walls, caps } = fileWithCaps();
  const loading = vi.spyOn(GLTFLoader.prototype, "loadAsync").mockResolvedValue({ scene } as never);
  const heart = new Heart({ material } as never);
  await heart.load(DESCRIPTION as never, "http://localhost/scene/scene.json");
  loading.mockRestore();
  return { heart, walls, caps };
}

function meshes(root: Object3D): Mesh<BoxGeometry, Material>[] {
  const found: Mesh<BoxGeometry, Material>[] = [];
  root.traverse((node) => {
    if (node instanceof Mesh) found.push(node as Mesh<BoxGeometry, Material>);
  });
  return found;
}

const seen = (heart: Heart): Mesh<BoxGeometry, Material>[] => meshes(heart.group).filter(({ visible }) => visible);

describe("Heart", () => {
  it("draws a part's walls, in every way in which they are drawn, and leaves its caps out", async () => {
    const { heart, walls, caps } = await loaded("standard");
    const all = [...meshes(heart.group), ...meshes(heart.inside)];
    expect(all.filter(({ geometry }) => geometry === walls)).toHaveLength(all.length);
    expect(all.some(({ geometry }) => geometry === caps)).toBe(false);
    // Far faces, depth, near faces; and the inner wall, in a scene of its own.
    expect([meshes(heart.group).length, meshes(heart.inside).length]).toEqual([3, 1]);
    for (const mesh of all) expect(new Vector3().setFromMatrixPosition(mesh.matrix).toArray()).toEqual([0.1, 0.2, 0.3]);
    const [part] = heart.parts;
    expect(part!.centre.distanceTo(new Vector3(100, -300, 200))).toBeLessThan(1e-6); // glTF (x, z, -y) / 1000 of ct = box here
    expect(part!.half.distanceTo(new Vector3(10, 20, 15))).toBeLessThan(1e-6);
  });

  it("draws the far faces before the near ones, without depth, where one looks through", async () => {
    const { heart } = await loaded("standard");
    heart.parts[0]!.show(true, 0.3);
    heart.parts[0]!.order(10, 20);
    const [far, near, ...more] = seen(heart).sort((a, b) => a.renderOrder - b.renderOrder);
    expect(more).toHaveLength(0);
    expect([far!.material.side, near!.material.side]).toEqual([BackSide, FrontSide]);
    for (const { material } of [far!, near!]) expect([material.transparent, material.depthWrite, material.opacity]).toEqual([true, false, 0.3]);
    expect((await loaded("lambert")).heart.group.children.filter(({ visible }) => visible)).toHaveLength(1); // the cheap way: near faces only
  });

  it("writes the depth of a dense part first, and of an opaque one with its colour", async () => {
    const { heart } = await loaded("standard");
    heart.parts[0]!.show(true, 0.8);
    expect(seen(heart).filter(({ material }) => !material.colorWrite && material.depthWrite)).toHaveLength(1);
    heart.parts[0]!.show(true, 1);
    for (const { material } of seen(heart)) expect([material.transparent, material.depthWrite, material.colorWrite]).toEqual([false, true, true]);
  });

  it("draws nothing of a part that is hidden or fully clear, and gives everything back", async () => {
    const { heart, walls } = await loaded("standard");
    heart.parts[0]!.show(false, 1);
    expect(seen(heart)).toHaveLength(0);
    heart.parts[0]!.show(true, 0);
    expect(seen(heart)).toHaveLength(0);
    const freed = vi.fn();
    walls.addEventListener("dispose", freed);
    heart.clear();
    expect(freed).toHaveBeenCalledTimes(1);
    expect([heart.group.children.length, heart.inside.children.length, heart.parts.length]).toEqual([0, 0, 0]);
  });
});

describe("FrameBudget", () => {
  it("lowers the resolution after slow frames, never below its floor, and not for pauses", () => {
    const budget = new FrameBudget(2, true);
    let now = 0;
    for (let i = 0; i < 20; i++) expect(budget.frame((now += 5000))).toBe(false);
    for (let i = 0; i < 500; i++) budget.frame((now += 60));
    expect(budget.pixelRatio).toBeCloseTo(0.6, 9);
    const fixed = new FrameBudget(2, false);
    for (let i = 0; i < 500; i++) fixed.frame((now += 60));
    expect(fixed.pixelRatio).toBe(2);
  });
});
