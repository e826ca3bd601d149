/** What tests and curious people can ask the flat pictures: `window.__cathxrFlat`. */

import { Matrix4, Vector3 } from "three";
import type { WebGLRenderTarget } from "three";
import type { IceMode } from "../ice/ice_mode";
import type { Change, SceneSettings } from "../stage/settings";
import type { Stage } from "../stage/stage";
import type { FlatView } from "./flat_view";

export interface FlatProbe {
  readonly settings: SceneSettings;
  set(change: Change): void;
  /** The drawn beam in `box`: where it begins, its direction, the ball; from the matrices that are drawn with. */
  beam(): { visible: boolean; origin: number[]; direction: number[]; axis: number[]; ball: number[] };
  /** The tip that is drawn, box_from_tip, column by column. */
  tip(): number[];
  /** The ultrasound picture: how many were made, why there is none, grey levels (line after line of a depth). */
  ice(): { made: number; message: string; lines: number; samples: number; grey: number[] };
  /** Where a point of `box`, mm, is in an arm's picture: -1 to 1 to the right and up. */
  inPicture(arm: 0 | 1, point: [number, number, number]): [number, number];
  /** Milliseconds that the pictures of one arm take from asking to having them, and of asking alone. */
  xrayCost(): { coarseMs: number; fineMs: number; asking: number };
  /** X-ray pictures worked out so far, of both arms. */
  xrayMade(): number;
  /** Draw calls and triangles of the last frame. */
  drawn(): { calls: number; triangles: number };
}

declare global {
  interface Window {
    __cathxrFlat?: FlatProbe;
  }
}

export function makeProbe(stage: Stage, ice: IceMode, flat: FlatView): FlatProbe {
  const { renderer, box } = stage.view;
  const boxFrom = (world: Matrix4): Matrix4 => {
    box.updateWorldMatrix(true, false);
    return new Matrix4().copy(box.matrixWorld).invert().multiply(world);
  };
  const wait = (target: WebGLRenderTarget): void => void renderer.readRenderTargetPixels(target, 0, 0, 1, 1, new Uint16Array(4));
  return {
    get settings() { return stage.store.value; },
    set: (change) => stage.store.set(change),
    beam: () => {
      const { ball, group } = ice.beam;
      ball.updateWorldMatrix(true, false);
      const frame = boxFrom(ball.parent!.matrixWorld);
      const column = (at: number): number[] => new Vector3().setFromMatrixColumn(frame, at).toArray();
      return {
        visible: group.visible && ball.parent!.visible, origin: column(3), direction: column(0), axis: column(2),
        ball: new Vector3().setFromMatrixPosition(boxFrom(ball.matrixWorld)).toArray(),
      };
    },
    tip: () => stage.tip.matrix.toArray(),
    ice: () => {
      const { lines, samples } = ice.imager.size;
      const rgba = new Uint8Array(4 * lines * samples);
      renderer.readRenderTargetPixels(ice.imager.target, 0, 0, lines, samples, rgba);
      return { made: ice.imager.made, message: ice.panel.message, lines, samples, grey: [...rgba.filter((_, at) => at % 4 === 0)] };
    },
    inPicture: (arm, point) => {
      const [x, y, z] = point;
      const e = flat.arms[arm].pictureFromBox.elements;
      const row = (at: number): number => e[at]! * x + e[at + 4]! * y + e[at + 8]! * z + e[at + 12]!;
      return [row(0) / row(3), row(1) / row(3)];
    },
    xrayCost: () => {
      const { image } = flat.arms[0];
      image.turn();
      const start = performance.now();
      image.update(start);
      const asking = performance.now() - start;
      wait(image.target);
      const coarse = performance.now();
      while (!image.update(start + 1e6));
      wait(image.target);
      return { coarseMs: coarse - start, fineMs: performance.now() - coarse, asking };
    },
    xrayMade: () => flat.arms[0].image.made + flat.arms[1].image.made,
    drawn: () => ({ calls: renderer.info.render.calls, triangles: renderer.info.render.triangles }),
  };
}
