/** Draws into off-screen pictures without disturbing what is drawn for the eyes. */

import { BufferAttribute, BufferGeometry, Camera, GLSL3, Mesh, NoBlending, RawShaderMaterial } from "three";
import type { IUniform, WebGLRenderer, WebGLRenderTarget } from "three";
import { FULL_SCREEN } from "./shaders";

export type Uniforms = Record<string, IUniform>;

export function makePass(fragmentShader: string, uniforms: Uniforms): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3, vertexShader: FULL_SCREEN, fragmentShader, uniforms,
    depthTest: false, depthWrite: false, blending: NoBlending,
  });
}

/**
 * One triangle that covers a target. While it draws, WebXR is off (else three.js would draw through the eyes' cameras)
 * and nothing is cleared (in immersive-ar three.js clears even off-screen targets to transparent black); afterwards
 * everything is as it was.
 */
export class Offscreen {
  private readonly mesh: Mesh<BufferGeometry, RawShaderMaterial>;
  private readonly camera = new Camera();
  private target: WebGLRenderTarget | null = null;
  private face = 0;
  private level = 0;
  private xr = false;
  private clears = false;
  private resets = false;
  private calls = 0;
  private triangles = 0;

  constructor(private readonly renderer: WebGLRenderer) {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]), 3));
    this.mesh = new Mesh(geometry, makePass("", {}));
    this.mesh.frustumCulled = false;
    this.mesh.matrixAutoUpdate = false;
  }

  begin(): void {
    const { renderer } = this;
    this.target = renderer.getRenderTarget();
    this.face = renderer.getActiveCubeFace();
    this.level = renderer.getActiveMipmapLevel();
    this.xr = renderer.xr.enabled;
    this.clears = renderer.autoClear;
    this.resets = renderer.info.autoReset;
    this.calls = renderer.info.render.calls;
    this.triangles = renderer.info.render.triangles;
    renderer.xr.enabled = false;
    renderer.autoClear = false;
    renderer.info.autoReset = false;
  }

  draw(pass: RawShaderMaterial, target: WebGLRenderTarget): void {
    this.mesh.material = pass;
    this.renderer.setRenderTarget(target);
    this.renderer.render(this.mesh, this.camera);
  }

  end(): void {
    const { renderer } = this;
    renderer.xr.enabled = this.xr;
    renderer.autoClear = this.clears;
    renderer.info.autoReset = this.resets;
    renderer.info.render.calls = this.calls; // the scene's own count: these are not drawn for the eyes
    renderer.info.render.triangles = this.triangles;
    // The headset's own target is never null: null there would mean the page's canvas.
    if (this.target !== null || !renderer.xr.isPresenting) renderer.setRenderTarget(this.target, this.face, this.level);
    this.target = null;
  }

  dispose(): void {
    this.mesh.geometry.dispose();
  }
}
