/** The 3D view: renderer, camera, lights and the `box` group that everything hangs from. */

import {
  AmbientLight,
  Color,
  DirectionalLight,
  Group,
  HemisphereLight,
  PerspectiveCamera,
  Quaternion,
  Scene,
  SRGBColorSpace,
  Vector3,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Settings } from "../settings";
import { FrameTimes } from "../xr/frame_times";
import { FrameBudget } from "./budget";
import { fitLabels } from "./label";

/** The buttons at the bottom of the view cover this much, CSS pixels: the picture is moved up by half of it. */
const COVERED_PX = 50;

/** Flat pictures on a desktop page: drawn over the 3D picture, or `alone` instead of it. Never in a headset. */
export interface Overlay {
  readonly alone: boolean;
  render(renderer: WebGLRenderer): void;
}

/** Labels are as large in a headset as on a view of this many pixels: about 1.5 degrees. */
const HEADSET_LABEL_PX = 420;
/** Clipping planes in a headset, m: a panel at the nose, and a heart of thirty times its size. */
const HEADSET_NEAR = 0.03;
const HEADSET_FAR = 60;
const BACKGROUND = new Color(0x0b1017);

/** On a page it draws only when something has changed: a page at rest costs nothing. In a headset it draws every frame. */
export class View {
  readonly scene = new Scene();
  /** Frame `box` in mm, inside a scene in metres with y up, as glTF and WebXR have it: (x, y, z) is at (x, z, -y) / 1000. */
  readonly box = new Group();
  readonly camera = new PerspectiveCamera(35, 1, 0.005, 10);
  readonly controls: OrbitControls;
  readonly renderer: WebGLRenderer;
  frames = 0;
  overlay: Overlay | null = null;
  /** Calls back when the graphics card takes the picture away (true) and gives it back (false). */
  onGraphicsLost: (lost: boolean) => void = () => undefined;
  /** Of a headset's frames. */
  readonly times = new FrameTimes();
  /** Draw calls and triangles of the last frame, of both eyes together in a headset. */
  readonly drawn = { calls: 0, triangles: 0 };
  /** Of a headset's wearer, in the room, m. */
  readonly head = { position: new Vector3(), orientation: new Quaternion() };
  private readonly eye = new Vector3();
  /** Called before every picture of a headset, when all that is in it is where it belongs. */
  onBeforePicture: () => void = () => undefined;
  /** Counts when labels may have come or gone. */
  labelsVersion = 0;
  private immersed = false;
  private readonly desktop = { position: new Vector3(), orientation: new Quaternion(), near: 0, far: 0 };
  private labelScale = 1;
  private dirty = true;
  private readonly budget: FrameBudget;
  private readonly host: HTMLElement;

  /** Throws Error when the browser gives no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, settings: Settings) {
    this.renderer = new WebGLRenderer({ canvas, antialias: settings.antialias, powerPreference: "high-performance" });
    this.renderer.outputColorSpace = SRGBColorSpace;
    this.host = canvas.parentElement!;
    this.renderer.xr.enabled = true;
    this.scene.background = BACKGROUND;
    this.box.name = "box";
    this.box.scale.setScalar(0.001);
    this.box.rotation.x = -Math.PI / 2;
    this.scene.add(this.box, this.camera);
    this.addLights();
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = !matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.controls.dampingFactor = 0.12;
    this.controls.minDistance = 0.02;
    this.controls.maxDistance = 2;
    this.controls.addEventListener("change", () => this.touch());
    this.budget = new FrameBudget(settings.pixelRatio ?? Math.min(devicePixelRatio || 1, 2), settings.pixelRatio === null);
    this.renderer.setPixelRatio(this.budget.pixelRatio);
    new ResizeObserver(() => this.resize()).observe(this.host);
    this.resize();
    canvas.addEventListener("webglcontextlost", () => this.onGraphicsLost(true));
    canvas.addEventListener("webglcontextrestored", () => {
      this.touch();
      this.onGraphicsLost(false);
    });
  }

  /** Calls `step` before every picture: at the screen's rate, and at the headset's while a session runs. */
  run(step: (nowMs: number) => void): void {
    this.renderer.setAnimationLoop((nowMs) => {
      const begunMs = performance.now();
      if (this.immersed && this.renderer.xr.isPresenting) this.findHead();
      step(nowMs);
      if (this.immersed) this.times.put(begunMs, performance.now());
    });
  }

  private findHead(): void {
    const { xr } = this.renderer;
    xr.updateCamera(this.camera); // to the left eye; the head is in the middle between them
    const cameras: readonly PerspectiveCamera[] = xr.getCamera().cameras;
    if (cameras.length === 0) return;
    this.head.position.set(0, 0, 0);
    for (const eye of cameras) this.head.position.add(this.eye.setFromMatrixPosition(eye.matrixWorld));
    this.head.position.divideScalar(cameras.length);
    this.head.orientation.copy(this.camera.quaternion);
  }

  /** Whether a headset's session shows this view: `camera` is then the wearer's left eye, and `head` between both. */
  get immersive(): boolean {
    return this.immersed;
  }

  /** Gives the view to a headset that has just begun a session; `through`: its wearer also sees the room. */
  immerse(through: boolean): void {
    const { camera, desktop } = this;
    desktop.position.copy(camera.position);
    desktop.orientation.copy(camera.quaternion);
    desktop.near = camera.near;
    desktop.far = camera.far;
    camera.near = HEADSET_NEAR;
    camera.far = HEADSET_FAR;
    this.renderer.xr.cameraAutoUpdate = false; // it is brought up to date at the beginning of each frame instead
    this.scene.background = through ? null : BACKGROUND;
    this.immersed = true;
    this.resize();
  }

  /** Takes the view back to the page. */
  emerge(): void {
    const { camera, desktop } = this;
    camera.position.copy(desktop.position);
    camera.quaternion.copy(desktop.orientation);
    camera.scale.setScalar(1);
    camera.near = desktop.near;
    camera.far = desktop.far;
    this.renderer.xr.cameraAutoUpdate = true;
    this.scene.background = BACKGROUND;
    this.immersed = false;
    this.labelScale = 1;
    this.resize();
  }

  /** Keeps the labels' size in the eye when the world below them is `scale` times as large. */
  scaleLabels(scale: number): void {
    if (Math.abs(scale / this.labelScale - 1) < 0.02) return;
    this.labelScale = scale;
    if (this.immersed) fitLabels(this.scene, HEADSET_LABEL_PX, scale);
  }

  /** Asks for a new picture at the next frame. */
  touch(): void {
    this.dirty = true;
  }

  /** Draws if needed; returns whether it drew. */
  draw(nowMs: number): boolean {
    if (this.immersed) {
      this.dirty = false;
      this.onBeforePicture();
      this.renderer.render(this.scene, this.camera);
      this.count();
      return true;
    }
    this.controls.update();
    if (!this.dirty) {
      this.budget.rest();
      return false;
    }
    this.dirty = false;
    if (this.budget.frame(nowMs)) this.renderer.setPixelRatio(this.budget.pixelRatio);
    if (this.overlay === null || !this.overlay.alone) this.renderer.render(this.scene, this.camera);
    this.count();
    this.overlay?.render(this.renderer);
    return true;
  }

  private count(): void {
    this.frames += 1;
    const { calls, triangles } = this.renderer.info.render;
    this.drawn.calls = calls;
    this.drawn.triangles = triangles;
  }

  /** The share of the view's height that no buttons cover. */
  get clearShare(): number {
    return Math.max(0.5, 1 - COVERED_PX / Math.max(1, this.host.clientHeight));
  }

  get pixelRatio(): number {
    return this.budget.pixelRatio;
  }

  /** Fits the picture to the page's layout; also to be called after labels were added. */
  resize(): void {
    this.labelsVersion += 1;
    if (this.immersed) {
      fitLabels(this.scene, HEADSET_LABEL_PX, this.labelScale);
      return;
    }
    const width = Math.max(1, this.host.clientWidth);
    const height = Math.max(1, this.host.clientHeight);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.setViewOffset(width, height, 0, COVERED_PX / 2, width, height);
    fitLabels(this.scene, height);
    this.touch();
  }

  private addLights(): void {
    const key = new DirectionalLight(0xffffff, 2.2);
    key.position.set(0.35, 0.6, 1); // fixed to the viewer's head: whatever is looked at is lit
    this.camera.add(key, key.target);
    key.target.position.set(0, 0, -1);
    this.scene.add(new HemisphereLight(0xdfeaf5, 0x2a3442, 1.3), new AmbientLight(0xffffff, 0.25));
  }
}
