/** Short texts that stand in the scene. */

import type { Object3D } from "three";
import { CanvasTexture, LinearFilter, Sprite, SpriteMaterial, SRGBColorSpace } from "three";

const PIXELS = 48;
/** Height of the view at distance 1, for the camera's field of view of 35 degrees. */
const FIELD = 2 * Math.tan((35 * Math.PI) / 360);

/** Height of a line on the screen, CSS pixels, its margins included: near and far labels are equally legible. */
const LINE_PX = { share: 0.042, least: 14, most: 20 };
/** The `box` group's scale, which would otherwise shrink what keeps its size on the screen. */
const METRES_PER_UNIT = 0.001;

/** What gives way to what where labels would lie over each other: 0 to none. */
export const RANK = { active: 0, place: 1, title: 2, tick: 3 } as const;
export type Rank = (typeof RANK)[keyof typeof RANK];

/** Returns a label's rank; null for one that is always shown. */
export function rankOf(label: Sprite): Rank | null {
  return (label.userData["rank"] as Rank | undefined) ?? null;
}

/** Returns a sprite with one line of text, anchored at its centre. Static: drawn once. With a rank it may have to give way. */
export function makeLabel(text: string, colour: string, rank: Rank | null = null): Sprite {
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("2d")!;
  const font = `600 ${PIXELS * 0.72}px system-ui, "Segoe UI", Roboto, sans-serif`;
  context.font = font;
  canvas.width = Math.ceil(context.measureText(text).width) + PIXELS * 0.3;
  canvas.height = PIXELS;
  context.font = font; // setting the size resets it
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.lineWidth = 7;
  context.lineJoin = "round";
  context.strokeStyle = "rgba(11, 16, 23, 0.85)";
  context.strokeText(text, canvas.width / 2, canvas.height / 2);
  context.fillStyle = colour;
  context.fillText(text, canvas.width / 2, canvas.height / 2);
  const map = new CanvasTexture(canvas);
  map.colorSpace = SRGBColorSpace;
  map.minFilter = LinearFilter;
  map.generateMipmaps = false;
  const sprite = new Sprite(new SpriteMaterial({ map, transparent: true, depthWrite: false, sizeAttenuation: false }));
  sprite.renderOrder = 40;
  if (rank !== null) sprite.userData["rank"] = rank;
  return sprite;
}

/** Gives every label under `root` its size on a view of `viewPx` CSS pixels in height, in a world scaled by `worldScale`. */
export function fitLabels(root: Object3D, viewPx: number, worldScale = 1): void {
  const line = Math.min(LINE_PX.most, Math.max(LINE_PX.least, LINE_PX.share * viewPx));
  const height = ((line / viewPx) * FIELD) / METRES_PER_UNIT / worldScale;
  root.traverse((node) => {
    if (!(node instanceof Sprite)) return;
    const { width, height: lines } = node.material.map!.image as HTMLCanvasElement;
    node.scale.set((height * width) / lines, height, 1);
  });
}
