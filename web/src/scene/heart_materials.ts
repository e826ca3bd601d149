/** How the heart's surfaces look: seen through, cut open, and from within. */

import { BackSide, Color, FrontSide, MeshBasicMaterial, MeshLambertMaterial, MeshStandardMaterial } from "three";
import type { Material } from "three";
import type { Settings } from "../settings";

/** Name of the material of what is cut open. */
export const CUT_FACE = "cut face";
export type Side = typeof FrontSide | typeof BackSide;
/** The inner wall's own colour, in which a part's colour still shows. */
const ENDOCARDIUM = new Color(0xd98c7c);
const OWN_COLOUR = 0.26;

/** Returns the surface as it is seen through from outside. */
export function translucent(settings: Settings, colour: string, side: Side): Material {
  const common = { color: new Color(colour), side, transparent: true, depthWrite: false };
  const material = settings.material === "lambert"
    ? new MeshLambertMaterial(common)
    : new MeshStandardMaterial({ ...common, roughness: 0.55, metalness: 0 });
  // Walls seen edge-on are longer ways through tissue: more opaque there, clearer where one looks straight through.
  material.onBeforeCompile = (shader) => {
    shader.fragmentShader = shader.fragmentShader.replace(
      "#include <opaque_fragment>",
      `float facing = abs(dot(normalize(normal), normalize(vViewPosition)));
      diffuseColor.a = mix(1.0 - pow(1.0 - min(diffuseColor.a, 0.999), 1.0 / max(facing, 0.16)), 1.0, step(0.985, diffuseColor.a));
      #include <opaque_fragment>`,
    );
  };
  return material;
}

/** Returns the far side of a part that is cut open: one looks into a hollow, the darker the deeper, with a bright rim. */
export function cutFace(colour: string): Material {
  const material = new MeshLambertMaterial({ name: CUT_FACE, color: new Color(colour), side: BackSide });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying float vUnit;")
      .replace("#include <project_vertex>", "#include <project_vertex>\nvUnit = length((modelViewMatrix * vec4(1.0, 0.0, 0.0, 0.0)).xyz);");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nvarying float vUnit;")
      .replace("#include <opaque_fragment>", `${HOLLOW}\n#include <opaque_fragment>`);
  };
  return material;
}

/** Depth behind the cut in the heart's metres; a rim of two pixels along its edge. */
const HOLLOW = `
#if NUM_CLIPPING_PLANES > 0
  float beyond = clippingPlanes[0].w - dot(vClipPosition, clippingPlanes[0].xyz);
  outgoingLight *= mix(0.92, 0.34, smoothstep(0.0, 0.05, beyond / max(vUnit, 1e-9)));
  outgoingLight = mix(vec3(1.0), outgoingLight, smoothstep(0.6, 2.2, beyond / max(fwidth(beyond), 1e-9)) * 0.6 + 0.4);
#endif`;

/** Returns what is written to the depth only, so that of a dense part the nearest face alone is seen. */
export function depthOnly(): Material {
  return new MeshBasicMaterial({ side: FrontSide, colorWrite: false });
}

/** Returns the inner wall, opaque and mottled: without a texture nothing would be seen to move past. */
export function innerWall(colour: string): Material {
  const material = new MeshLambertMaterial({ color: ENDOCARDIUM.clone().lerp(new Color(colour), OWN_COLOUR), side: BackSide });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvPlace = (modelMatrix * vec4(position, 1.0)).xyz;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", `#include <common>\nvarying vec3 vPlace;\n${MOTTLE}`)
      .replace("#include <color_fragment>", "#include <color_fragment>\ndiffuseColor.rgb *= mottle(vPlace);")
      .replace("#include <opaque_fragment>", `${TONE}\n#include <opaque_fragment>`);
  };
  return material;
}

/** A wall close by is bright, not white, and keeps its colour: the brightest channel is brought below 1, the others along with it. */
const TONE = `
  float brightest = max(max(outgoingLight.r, outgoingLight.g), max(outgoingLight.b, 1e-4));
  outgoingLight *= (1.0 - exp(-1.15 * brightest)) / brightest;`;

/** Brightness from a place in mm: smooth noise of 6 mm and 2 mm, and the fine ridges that trabeculae are. */
const MOTTLE = `
float scramble(vec3 p) {
  p = fract(p * vec3(0.1031, 0.1030, 0.0973));
  p += dot(p, p.yxz + 33.33);
  return fract((p.x + p.y) * p.z);
}
float grain(vec3 p) {
  vec3 i = floor(p);
  vec3 f = fract(p);
  f = f * f * (3.0 - 2.0 * f);
  return mix(
    mix(mix(scramble(i), scramble(i + vec3(1, 0, 0)), f.x), mix(scramble(i + vec3(0, 1, 0)), scramble(i + vec3(1, 1, 0)), f.x), f.y),
    mix(mix(scramble(i + vec3(0, 0, 1)), scramble(i + vec3(1, 0, 1)), f.x), mix(scramble(i + vec3(0, 1, 1)), scramble(i + vec3(1, 1, 1)), f.x), f.y),
    f.z);
}
float mottle(vec3 place) {
  vec3 p = place + 200.0;
  float ridge = abs(2.0 * grain(p / 3.5) - 1.0);
  return 0.72 + 0.22 * grain(p / 6.0) + 0.10 * grain(p / 1.7) + 0.16 * smoothstep(0.0, 0.5, ridge);
}`;
