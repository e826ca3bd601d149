/** A headset in the page itself, for looking without one and for the tests: `?xr=emulate`. Its own chunk, loaded on request. */

import { metaQuest3, XRDevice } from "iwer";

declare global {
  interface Window {
    __headset?: XRDevice;
  }
}

/** Puts an emulated headset with two eyes behind `navigator.xr`. To be called before the view is made. */
export function emulateHeadset(): void {
  rememberClearValues();
  const device = new XRDevice(metaQuest3, { stereoEnabled: true });
  device.installRuntime({ forceInstall: true });
  device.position.set(0, 1.6, 0);
  window.__headset = device;
}

/**
 * The emulator reads the clear values back from the graphics card at every frame, which waits for all that was drawn:
 * answers those three from what was last set instead.
 */
function rememberClearValues(): void {
  const { prototype } = WebGL2RenderingContext;
  const { clearColor, clearDepth, clearStencil, getParameter } = prototype;
  const known = new WeakMap<WebGL2RenderingContext, { colour: Float32Array; depth: number; stencil: number }>();
  const of = (context: WebGL2RenderingContext): { colour: Float32Array; depth: number; stencil: number } => {
    let values = known.get(context);
    if (values === undefined) known.set(context, (values = { colour: new Float32Array(4), depth: 1, stencil: 0 }));
    return values;
  };
  prototype.clearColor = function (red, green, blue, alpha): void {
    of(this).colour.set([red, green, blue, alpha]);
    clearColor.call(this, red, green, blue, alpha);
  };
  prototype.clearDepth = function (depth): void {
    of(this).depth = depth;
    clearDepth.call(this, depth);
  };
  prototype.clearStencil = function (stencil): void {
    of(this).stencil = stencil;
    clearStencil.call(this, stencil);
  };
  prototype.getParameter = function (name): unknown {
    if (name === this.COLOR_CLEAR_VALUE) return of(this).colour.slice();
    if (name === this.DEPTH_CLEAR_VALUE) return of(this).depth;
    if (name === this.STENCIL_CLEAR_VALUE) return of(this).stencil;
    return getParameter.call(this, name) as unknown;
  };
}
