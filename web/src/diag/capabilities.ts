/** What the browser and its graphics offer. */

import type { DiagDevice, DiagGraphics } from "../generated/messages";

const MOST_TEXT = 300;
const MOST_EXTENSIONS = 200;

/** Returns what a browser says of itself and of headsets. */
export async function deviceOf(): Promise<DiagDevice> {
  const supported = async (mode: XRSessionMode): Promise<boolean> => {
    try {
      return (await navigator.xr?.isSessionSupported(mode)) ?? false;
    } catch {
      return false;
    }
  };
  const memory = (navigator as { deviceMemory?: number }).deviceMemory; // not in every browser
  return {
    user_agent: plain(navigator.userAgent),
    secure: isSecureContext,
    webxr: navigator.xr !== undefined,
    vr: await supported("immersive-vr"),
    ar: await supported("immersive-ar"),
    screen_px: [Math.round(screen.width * devicePixelRatio), Math.round(screen.height * devicePixelRatio)],
    pixel_ratio: devicePixelRatio,
    cores: navigator.hardwareConcurrency || 0,
    memory_gb: memory ?? null,
    touch_points: navigator.maxTouchPoints || 0,
  };
}

/** Returns what a context of WebGL 2 offers; null: the browser gave none. */
export function graphicsOf(gl: WebGL2RenderingContext | null): DiagGraphics {
  if (gl === null) {
    return {
      webgl2: false, vendor: "", renderer: "", version: "", max_texture: 0, max_texture_3d: 0, max_samples: 0,
      max_uniform_vectors: 0, extensions: [],
    };
  }
  const told = gl.getExtension("WEBGL_debug_renderer_info");
  const number = (name: number): number => Number(gl.getParameter(name)) || 0;
  return {
    webgl2: true,
    vendor: plain(gl.getParameter(told === null ? gl.VENDOR : told.UNMASKED_VENDOR_WEBGL)),
    renderer: plain(gl.getParameter(told === null ? gl.RENDERER : told.UNMASKED_RENDERER_WEBGL)),
    version: plain(gl.getParameter(gl.VERSION)),
    max_texture: number(gl.MAX_TEXTURE_SIZE),
    max_texture_3d: number(gl.MAX_3D_TEXTURE_SIZE),
    max_samples: number(gl.MAX_SAMPLES),
    max_uniform_vectors: number(gl.MAX_FRAGMENT_UNIFORM_VECTORS),
    extensions: (gl.getSupportedExtensions() ?? []).slice(0, MOST_EXTENSIONS).map(plain),
  };
}

/** The server takes short texts without control characters. */
function plain(text: unknown): string {
  return String(text ?? "").replaceAll(/[\u0000-\u001f\u007f]/g, " ").slice(0, MOST_TEXT);
}
