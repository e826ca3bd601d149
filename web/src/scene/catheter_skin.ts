/** The catheter's skin: ivory with a ring each 10 mm, a metal tip, the transducer's window, and where the beam looks. */

import { DataTexture, LinearFilter, LinearMipmapLinearFilter, RepeatWrapping, SRGBColorSpace } from "three";
import type { Material } from "three";
import { ARRAY_BEHIND_TIP_MM } from "../ice/transducer";
import { MARK_MM } from "../maths/tube";

/** Half the array's length, and half of what it takes of the way round. */
const WINDOW_HALF_MM = 3.5;
const WINDOW_HALF_TURN = 0.15;
const TIP_MM = 1.2;

/** The tube's pattern, 10 mm long, repeated: a thin ring, and with `beam` a green stripe where the beam looks out. */
export function stripes(beam: boolean): DataTexture {
  const around = 128;
  const along = 64;
  const data = new Uint8Array(4 * around * along);
  for (let row = 0; row < along; row++) {
    for (let column = 0; column < around; column++) {
      const turn = Math.min(column, around - column) / around;
      const colour = beam && turn < 0.1 ? [14, 150, 84] : row < 4 ? [120, 128, 138] : [238, 234, 222];
      data.set([...colour, 255], 4 * (row * around + column));
    }
  }
  const texture = new DataTexture(data, around, along);
  texture.wrapS = texture.wrapT = RepeatWrapping;
  texture.magFilter = LinearFilter;
  texture.minFilter = LinearMipmapLinearFilter;
  texture.generateMipmaps = true;
  texture.anisotropy = 4;
  texture.colorSpace = SRGBColorSpace;
  texture.needsUpdate = true;
  return texture;
}

/** Whether the roll is known, for the shaders of all materials of one catheter. */
export interface SkinUniforms {
  readonly rolled: { value: number };
}

/**
 * Makes a material with a map draw what does not repeat along the tube. Without a roll the window goes all the way round:
 * nobody knows on which side it is.
 */
export function markTip<M extends Material>(material: M, uniforms: SkinUniforms): M {
  material.onBeforeCompile = (shader) => {
    shader.uniforms["rolled"] = uniforms.rolled;
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nuniform float rolled;")
      .replace("#include <map_fragment>", `#include <map_fragment>\n${TIP}`);
  };
  return material;
}

const TIP = `
{
  float mm = vMapUv.y * ${MARK_MM.toFixed(1)};
  float turn = abs(fract(vMapUv.x + 0.5) - 0.5);
  float soft = max(fwidth(mm), 0.02);
  float within = 1.0 - smoothstep(-soft, soft, abs(mm - ${ARRAY_BEHIND_TIP_MM.toFixed(1)}) - ${WINDOW_HALF_MM.toFixed(1)});
  float side = 1.0 - smoothstep(-0.012, 0.012, turn - ${WINDOW_HALF_TURN.toFixed(2)});
  float window = within * mix(0.45, side, rolled);
  diffuseColor.rgb = mix(diffuseColor.rgb, vec3(0.012, 0.075, 0.05), 0.9 * window);
  diffuseColor.rgb = mix(vec3(0.42, 0.46, 0.50), diffuseColor.rgb, smoothstep(-soft, soft, mm - ${TIP_MM.toFixed(1)}));
#ifdef USE_COLOR
  float walled = clamp(1.1 * (1.0 - vColor.g), 0.0, 1.0); // what is in the wall stands out from its own pattern, and through the heart
  diffuseColor.rgb = mix(diffuseColor.rgb, vec3(1.0), 0.85 * walled);
  diffuseColor.a = mix(diffuseColor.a, 1.0, 0.9 * walled);
#endif
}`;
