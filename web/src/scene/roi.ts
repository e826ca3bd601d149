/** The region of interest: edges, floor grid, scales in mm, axes and the inlet. */

import {
  BufferGeometry,
  Color,
  Float32BufferAttribute,
  Group,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshStandardMaterial,
  Sprite,
  TorusGeometry,
} from "three";
import type { Material } from "three";
import type { SceneDescription } from "../generated/messages";
import { makeLabel, RANK } from "./label";

const GRID_MM = 10;
const TICK_MM = 40;
const AXES = [
  { name: "x", colour: "#ff7a7a" },
  { name: "y", colour: "#7ee29a" },
  { name: "z", colour: "#7fb2ff" },
] as const;

/** Returns the drawing of a scene's region of interest, in `box` mm. */
export function makeRoi(scene: SceneDescription): Group {
  const group = new Group();
  group.name = "roi";
  const low = scene.roi_min_mm;
  const high = scene.roi_max_mm;
  group.add(lines({ at: edges(low, high), colour: 0x3f4e61 }));
  const grid = lines({ at: floor(low, high, GRID_MM), colour: 0x1c2733 }, { at: floor(low, high, TICK_MM / 2), colour: 0x2a3948 });
  grid.name = "floor"; // not drawn where the wearer of a headset sees their own
  group.add(grid);
  group.add(...scales(low, high));
  group.add(inlet(scene.catheter_diameter_mm));
  return group;
}

/** Frees what `makeRoi` put on the graphics card. */
export function disposeRoi(group: Group): void {
  group.traverse((node) => {
    if (node instanceof Sprite) node.material.map?.dispose();
    const { geometry, material } = node as Partial<Mesh>;
    geometry?.dispose();
    (material as Material | undefined)?.dispose();
  });
  group.removeFromParent();
}

type Corner = readonly [number, number, number];

interface Strokes {
  readonly at: readonly number[];
  readonly colour: number;
}

/** Returns strokes of several colours, in one go. */
function lines(...strokes: readonly Strokes[]): LineSegments {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new Float32BufferAttribute(strokes.flatMap(({ at }) => at), 3));
  const colours = strokes.flatMap(({ at, colour }) => Array.from({ length: at.length / 3 }, () => new Color(colour).toArray()).flat());
  geometry.setAttribute("color", new Float32BufferAttribute(colours, 3));
  return new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true }));
}

function edges(low: Corner, high: Corner): number[] {
  const [x0, y0, z0] = low;
  const [x1, y1, z1] = high;
  const result: number[] = [];
  for (const y of [y0, y1]) for (const z of [z0, z1]) result.push(x0, y, z, x1, y, z);
  for (const x of [x0, x1]) for (const z of [z0, z1]) result.push(x, y0, z, x, y1, z);
  for (const x of [x0, x1]) for (const y of [y0, y1]) result.push(x, y, z0, x, y, z1);
  return result;
}

function floor(low: Corner, high: Corner, step: number): number[] {
  const [x0, y0, z] = low;
  const [x1, y1] = high;
  const result: number[] = [];
  for (const x of multiples(x0, x1, step)) result.push(x, y0, z, x, y1, z);
  for (const y of multiples(y0, y1, step)) result.push(x0, y, z, x1, y, z);
  return result;
}

function multiples(low: number, high: number, step: number): number[] {
  const result: number[] = [];
  for (let value = Math.ceil(low / step) * step; value <= high + 1e-6; value += step) result.push(value);
  return result;
}

/** Numbers along one edge of each axis: x and y on the floor in front, z up the edge on the left. */
function scales(low: Corner, high: Corner): Sprite[] {
  const off = 7;
  const place: ((value: number) => [number, number, number])[] = [
    (x) => [x, low[1] - off, low[2]],
    (y) => [high[0] + off, y, low[2]],
    (z) => [low[0] - off * 0.7, high[1] + off * 0.7, z],
  ];
  return AXES.flatMap((axis, index) => {
    const values = multiples(low[index]!, high[index]!, TICK_MM).filter((value) => index !== 2 || value > low[2] + 1);
    const ticks = values.map((value) => at(makeLabel(String(value).replace("-", "−"), "#8b9bad", RANK.tick), place[index]!(value)));
    const between = (Math.floor((low[index]! + high[index]!) / 2 / TICK_MM) + 0.5) * TICK_MM;
    return [...ticks, at(makeLabel(`${axis.name} mm`, axis.colour, RANK.title), place[index]!(between))];
  });
}

function at(sprite: Sprite, position: Corner): Sprite {
  sprite.position.set(...position);
  return sprite;
}

/** A ring around the origin, where the catheter comes in. */
function inlet(diameterMm: number): Group {
  const group = new Group();
  const material = new MeshStandardMaterial({ color: 0x93a4b5, roughness: 0.4, metalness: 0.2 });
  const ring = new Mesh(new TorusGeometry(Math.max(3.5, diameterMm * 1.6), 0.9, 12, 40), material);
  ring.rotation.y = Math.PI / 2;
  group.add(ring, at(makeLabel("inlet", "#b9c6d4", RANK.title), [0, 0, -10]));
  return group;
}
