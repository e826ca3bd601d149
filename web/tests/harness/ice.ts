/** The ultrasound image on a page of its own, steered by tests/e2e/test_ultrasound_shader.py. */

import { Matrix4, OrthographicCamera, Scene, WebGLRenderer, WebGLRenderTarget } from "three";
import { AcousticVolume, IceImager, IcePanel, LabelVolume } from "../../src/ultrasound";
import type { IceSettings } from "../../src/ultrasound";

const canvas = document.getElementById("view") as HTMLCanvasElement;
const renderer = new WebGLRenderer({ canvas, antialias: false, preserveDrawingBuffer: true });
const imager = new IceImager(renderer);
const panel = new IcePanel(imager);
const scene = new Scene();
scene.add(panel.group);
const camera = new OrthographicCamera(-0.2, 0.2, 0.15, -0.15, -1, 1);
const pose = new Matrix4();

async function bytes(url: string): Promise<Uint8Array<ArrayBuffer>> {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: status ${response.status}`);
  return new Uint8Array(await response.arrayBuffer());
}

function base64(values: Uint8Array): string {
  let text = "";
  for (let i = 0; i < values.length; i += 0x8000) text += String.fromCharCode(...values.subarray(i, i + 0x8000));
  return btoa(text);
}

const ice = {
  get renderer(): string {
    const gl = renderer.getContext();
    const told = gl.getExtension("WEBGL_debug_renderer_info");
    return String(gl.getParameter(told === null ? gl.RENDERER : told.UNMASKED_RENDERER_WEBGL));
  },
  resolved: () => ({ ...imager.resolved, lateral: [...imager.resolved.lateral], axial: [...imager.resolved.axial] }),
  settings: (change: Partial<IceSettings>) => {
    imager.setSettings(change);
    panel.refresh();
  },
  volume: async (url: string, size: [number, number, number], ctFromVoxel: number[]) =>
    imager.setVolume(new AcousticVolume(await bytes(url), size, ctFromVoxel)),
  labels: async (url: string, size: [number, number, number], ctFromVoxel: number[], colours: [number, string][]) =>
    panel.fan.colour(new LabelVolume(await bytes(url), size, ctFromVoxel, new Map(colours)), 0.5),
  colourless: () => panel.fan.colour(null, 0),
  pose: (rowByRow: number[]) => {
    pose.fromArray(rowByRow).transpose();
    imager.setPose(pose);
    panel.fan.setPose(pose);
  },
  /** Returns the polar picture's grey levels, line after line of a depth, as base64. */
  picture: (seq: number, persistence = 0): string => {
    imager.make(seq, persistence);
    const { lines, samples } = imager.size;
    const rgba = new Uint8Array(4 * lines * samples);
    renderer.readRenderTargetPixels(imager.target, 0, 0, lines, samples, rgba);
    return base64(rgba.filter((_, at) => at % 4 === 0));
  },
  /** Draws the panel on the canvas; returns the page's error state. */
  draw: (): number => {
    panel.refresh();
    renderer.render(scene, camera);
    return renderer.getContext().getError();
  },
  /** The canvas as it was drawn last, as a PNG in base64. */
  png: (): string => canvas.toDataURL("image/png").split(",")[1]!,
  made: () => imager.made,
  /** Makes a picture as within a headset's frame; returns what of the renderer is as it was. */
  kept: () => {
    const eyes = new WebGLRenderTarget(16, 16);
    const calls = renderer.info.render.calls;
    renderer.setRenderTarget(eyes);
    renderer.xr.enabled = true;
    imager.make();
    const told = {
      target: renderer.getRenderTarget() === eyes, xr: renderer.xr.enabled, autoClear: renderer.autoClear,
      calls: renderer.info.render.calls - calls,
    };
    renderer.xr.enabled = false;
    renderer.setRenderTarget(null);
    eyes.dispose();
    return told;
  },
  update: (nowS: number) => imager.update(nowS),
  freeze: (frozen: boolean) => (imager.frozen = frozen),
  /** Returns the milliseconds that a picture takes, from asking to having it: the mean of `count`. */
  milliseconds: (count: number): number => {
    const pixel = new Uint8Array(4);
    const wait = () => renderer.readRenderTargetPixels(imager.target, 0, 0, 1, 1, pixel);
    imager.make();
    wait();
    const start = performance.now();
    for (let i = 0; i < count; i++) {
      imager.make();
      wait();
    }
    return (performance.now() - start) / count;
  },
  /** Returns the milliseconds of JavaScript that asking for a picture takes. */
  script: (count: number): number => {
    const start = performance.now();
    for (let i = 0; i < count; i++) imager.make();
    return (performance.now() - start) / count;
  },
};

declare global {
  interface Window { ice: typeof ice }
}
window.ice = ice;
