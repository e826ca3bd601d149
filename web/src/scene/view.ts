/** The 3D view: renderer, camera, lights and the `box` group that everything hangs from. */

import {
  AmbientLight,
  Color,
  DirectionalLight,
  Group,
  HemisphereLight,
  PerspectiveCamera,
  Scene,
  SRGBColorSpace,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import type { Settings } from "../settings";
import { FrameBudget } from "./budget";
import { fitLabels } from "./label";

/** The buttons at the bottom of the view cover this much, CSS pixels: the picture is moved up by half of it. */
const COVERED_PX = 50;

/** Draws only when something has changed: a page at rest costs nothing. */
export class View {
  readonly scene = new Scene();
  /** Frame `box` in mm, inside a scene in metres with y up, as glTF and WebXR have it: (x, y, z) is at (x, z, -y) / 1000. */
  readonly box = new Group();
  readonly camera = new PerspectiveCamera(35, 1, 0.005, 10);
  readonly controls: OrbitControls;
  readonly renderer: WebGLRenderer;
  frames = 0;
  private dirty = true;
  private readonly budget: FrameBudget;
  private readonly host: HTMLElement;

  /** Throws Error when the browser gives no WebGL 2. */
  constructor(canvas: HTMLCanvasElement, settings: Settings) {
    this.renderer = new WebGLRenderer({ canvas, antialias: settings.antialias, powerPreference: "high-performance" });
    this.renderer.outputColorSpace = SRGBColorSpace;
    this.host = canvas.parentElement!;
    this.scene.background = new Color(0x0b1017);
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
  }

  /** Asks for a new picture at the next frame. */
  touch(): void {
    this.dirty = true;
  }

  /** Draws if needed; returns whether it drew. */
  draw(nowMs: number): boolean {
    this.controls.update();
    if (!this.dirty) {
      this.budget.rest();
      return false;
    }
    this.dirty = false;
    if (this.budget.frame(nowMs)) this.renderer.setPixelRatio(this.budget.pixelRatio);
    this.renderer.render(this.scene, this.camera);
    this.frames += 1;
    return true;
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
