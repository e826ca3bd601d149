/** The view from the tip into the heart: what an endoscope would see if blood were clear. */

import { AmbientLight, Color, Matrix4, PerspectiveCamera, PointLight, Scene, SRGBColorSpace, Vector3, WebGLRenderTarget } from "three";
import type { Texture, WebGLRenderer } from "three";
import type { Settings } from "../settings";
import type { Feature, Frame, TipPose } from "../stage/feature";
import type { Stage } from "../stage/stage";

/** The picture for whoever shows it. */
export interface TipView {
  readonly texture: Texture;
  /** Width over height. */
  readonly aspect: number;
  /** Whether there is a picture now: a heart is loaded and the tip is known. */
  readonly active: boolean;
  /** Whether somebody looks at it; without that nothing is drawn. To be set by whoever shows it. */
  wanted: boolean;
}

/** Across the picture; a wide lens, as such instruments have. */
const FIELD_DEG = 100;
const NEAR_MM = 0.3;
const FAR_MM = 250;
const SIZE_PX = 512;
const CHEAP_PX = 192;
const EVERY_MS = 1000 / 30 - 4; // a display's frames do not come at multiples of it
/** Without a roll the picture keeps upright, easing along with the tip. */
const EASE_S = 0.3;
/** Where there is no wall to be seen: within tissue, and where a vessel goes on beyond the heart's file. */
const BACKGROUND = new Color(0x2a0809);

export class EndoscopePicture implements TipView {
  readonly aspect = 1;
  active = false;
  wanted = false;
  readonly target: WebGLRenderTarget;

  constructor(settings: Settings) {
    const size = settings.material === "lambert" ? CHEAP_PX : SIZE_PX;
    this.target = new WebGLRenderTarget(size, size, { samples: settings.antialias ? 4 : 0 });
    this.target.texture.colorSpace = SRGBColorSpace;
  }

  get texture(): Texture {
    return this.target.texture;
  }
}

export class Endoscope implements Feature {
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(FIELD_DEG, 1, NEAR_MM, FAR_MM);
  private readonly upright = new Upright();
  private drawnMs = -Infinity;
  private version = -1;
  private readonly drawnFrom = new Matrix4();
  private readonly kept = { colour: new Color(), alpha: 1 };

  constructor(private readonly stage: Stage) {
    const light = new PointLight(0xfff2e6, 46, 0, 1); // at the tip; falls off so that depth is seen
    this.scene.add(stage.heart.inside, this.camera, new AmbientLight(0xffe6dd, 0.16));
    this.camera.add(light);
    this.camera.matrixAutoUpdate = false;
  }

  update(frame: Frame): boolean {
    const { tip, heart, store } = this.stage;
    const picture = this.stage.endoscope;
    picture.active = tip.valid && heart.parts.length > 0 && !store.value.ice;
    if (!picture.active || !picture.wanted) {
      this.drawnMs = -Infinity;
      return false;
    }
    this.upright.update(tip, frame.dtS, this.camera.matrix);
    if (frame.nowMs - this.drawnMs < EVERY_MS) return false;
    if (this.version === heart.version && this.drawnMs > 0 && resembles(this.camera.matrix, this.drawnFrom)) return false;
    this.version = heart.version;
    this.drawnMs = frame.nowMs;
    this.drawnFrom.copy(this.camera.matrix);
    this.camera.matrixWorldNeedsUpdate = true;
    this.draw(this.stage.view.renderer);
    return true;
  }

  private draw(renderer: WebGLRenderer): void {
    const { xr } = renderer;
    const target = renderer.getRenderTarget();
    const { enabled } = xr;
    const { autoClear } = renderer;
    renderer.getClearColor(this.kept.colour);
    this.kept.alpha = renderer.getClearAlpha();
    xr.enabled = false;
    renderer.autoClear = false;
    renderer.setRenderTarget(this.stage.endoscope.target);
    renderer.setClearColor(BACKGROUND, 1);
    renderer.clear();
    renderer.render(this.scene, this.camera);
    renderer.setRenderTarget(target);
    renderer.setClearColor(this.kept.colour, this.kept.alpha);
    renderer.autoClear = autoClear;
    xr.enabled = enabled;
  }
}

/**
 * Which way is up in the view from the tip. With a roll the picture turns as the catheter is turned, the beam's direction
 * up; without one it keeps the box's up up, and where the tip looks straight up or down, what was up before.
 */
export class Upright {
  private readonly up = new Vector3(0, 0, 1);
  private readonly forward = new Vector3();
  private readonly wanted = new Vector3();
  private readonly side = new Vector3();
  private readonly position = new Vector3();
  private begun = false;

  /** Writes box_from_camera (three's camera: looks along -z, y up), mm. */
  update(tip: TipPose, dtS: number, out: Matrix4): void {
    this.forward.setFromMatrixColumn(tip.matrix, 2);
    if (tip.beam) this.wanted.setFromMatrixColumn(tip.matrix, 0);
    else this.wanted.set(0, 0, 1);
    const sine = this.side.crossVectors(this.forward, this.wanted).length();
    if (sine < 0.2 && this.begun) this.wanted.copy(this.up);
    if (!this.begun || tip.beam) this.up.copy(this.wanted);
    else this.up.lerp(this.wanted, 1 - Math.exp(-dtS / EASE_S));
    this.begun = true;
    this.up.addScaledVector(this.forward, -this.up.dot(this.forward));
    if (this.up.lengthSq() < 1e-6) this.up.set(0, 1, 0).addScaledVector(this.forward, -this.forward.y);
    this.up.normalize();
    this.side.crossVectors(this.forward, this.up);
    this.position.setFromMatrixPosition(tip.matrix);
    out.makeBasis(this.side, this.up, this.forward.negate()).setPosition(this.position);
  }
}

function resembles(a: Matrix4, b: Matrix4): boolean {
  for (let i = 0; i < 16; i++) {
    if (Math.abs(a.elements[i]! - b.elements[i]!) > (i >= 12 ? 0.01 : 0.0005)) return false;
  }
  return true;
}
