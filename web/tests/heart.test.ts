import { BoxGeometry, Group, Matrix4, Mesh, MeshStandardMaterial, Vector3 } from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { describe, expect, it, vi } from "vitest";
import { Heart, boxFromGltf } from "../src/scene/heart";
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

describe("Heart", () => {
  it("draws a part's walls and leaves its caps out", async () => {
    const made = (name: string) => new Mesh(new BoxGeometry(), new MeshStandardMaterial({ name }));
    // A mesh of two primitives comes out of the loader as a group of two meshes.
    const part = new Group();
    part.name = "right_atrium";
    const walls = made("right_atrium");
    part.add(walls, made("caps"));
    const scene = new Group();
    scene.add(part);
    const loaded = vi.spyOn(GLTFLoader.prototype, "loadAsync").mockResolvedValue({ scene } as never);
    const heart = new Heart({ material: "lambert" } as never);
    await heart.load(
      {
        glb: "heart.glb",
        parts: [{ key: "right_atrium", name: "Right atrium", node: "right_atrium", colour: "#5fb0d0", opacity: 0.3 }],
        registration: {
          kind: "placement", fre_mm: null, tre_mm: null, scale: 1,
          ct_from_box: { rotation_wxyz: [1, 0, 0, 0], translation_mm: [0, 0, 0] },
        },
      } as never,
      "http://localhost/scene/scene.json",
    );
    expect(heart.group.children).toHaveLength(1);
    expect((heart.group.children[0] as Mesh).geometry).toBe(walls.geometry);
    loaded.mockRestore();
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
