/** The X-ray picture in GLSL ES 3.00: what weakens each ray, how the detector shows it, and the catheter over it. */

const HEAD = `
precision highp float;
precision highp int;
precision highp sampler3D;
`;

/**
 * Optical depth beyond that of lung all the way, along the ray of each pixel. The heart comes from its volume; the spine,
 * the back, the ribs and the diaphragm around it are drawn: they tell the sides apart, as in a cath lab.
 */
export const MARCH = `${HEAD}
uniform sampler3D tissue;
uniform mat4 voxelFromCt;
uniform vec3 voxels, source, along, right, up, centre, spine;
uniform float mostPerMm, lungPerMm, softPerMm, bonePerMm, detector, distance_, reach, lowest, chest;
uniform vec2 size;
uniform int steps;
out vec4 depth;

float hash(vec2 p) {
  uvec2 q = uvec2(p);
  uint h = q.x * 0x85EBCA77u ^ q.y * 0xC2B2AE3Du;
  h ^= h >> 16; h *= 0x7FEB352Du; h ^= h >> 15; h *= 0x846CA68Bu; h ^= h >> 16;
  return float(h >> 8) / 16777216.0;
}

/** Beyond lung, 1/mm; at the volume's sides it fades, so that a vessel cut there does not end in an edge. */
float heartAt(vec3 p) {
  vec3 at = ((voxelFromCt * vec4(p, 1.0)).xyz + 0.5) / voxels;
  vec3 inside = smoothstep(vec3(0.0), 3.0 / voxels, at) * smoothstep(vec3(0.0), 3.0 / voxels, 1.0 - at);
  float share = inside.x * inside.y * inside.z;
  return share > 0.0 ? share * max(0.0, texture(tissue, at).r * mostPerMm - lungPerMm) : 0.0;
}

/** The drawn chest, without ribs: vertebrae and discs, the muscles of the back, what lies below the diaphragm. */
float chestAt(vec3 p) {
  vec2 off = p.xy - spine.xy;
  float body = length(off / vec2(17.0, 14.0));
  float level = fract((p.z - spine.z) / 27.0);
  float disc = smoothstep(0.0, 0.05, level) * smoothstep(0.0, 0.05, 0.79 - level);
  float shell = smoothstep(0.7, 0.95, body);
  float vertebra = (1.0 - smoothstep(0.92, 1.08, body)) * mix(softPerMm, mix(0.62, 0.9, shell) * bonePerMm, disc);
  float arch = (1.0 - smoothstep(0.8, 1.1, length((off - vec2(0.0, 30.0)) / vec2(7.0, 15.0)))) * 0.6 * bonePerMm * disc;
  float back = (1.0 - smoothstep(0.85, 1.1, length((off - vec2(0.0, 24.0)) / vec2(52.0, 26.0)))) * softPerMm;
  vec2 dome = (p.xy - centre.xy - vec2(-12.0, 8.0)) / vec2(150.0, 120.0);
  float below = smoothstep(5.0, -7.0, p.z - (lowest - 5.0 - 42.0 * dot(dome, dome))) * 0.42 * softPerMm;
  return max(0.0, max(max(vertebra, arch), max(back, below)) - lungPerMm);
}

/** Both walls of the rib cage where the ray passes them: an elliptic tube with slanting ribs. */
float ribs(vec3 ray) {
  vec2 middle = vec2(spine.x, spine.y - 82.0);
  vec2 axes = vec2(132.0, 98.0);
  vec2 o = (source.xy - middle) / axes;
  vec2 d = ray.xy / axes;
  float a = dot(d, d), b = dot(o, d), c = dot(o, o) - 1.0;
  float root = b * b - a * c;
  if (root <= 0.0) return 0.0;
  float sum = 0.0;
  for (int side = -1; side <= 1; side += 2) {
    vec3 p = source + (-b + float(side) * sqrt(root)) / a * ray;
    vec2 normal = normalize((p.xy - middle) / (axes * axes));
    float across = max(abs(dot(normal, ray.xy)), 0.3);
    float phase = fract((p.z + 0.42 * (spine.y - p.y)) / 27.0) - 0.5;
    float rib = smoothstep(0.24, 0.17, abs(phase));
    sum += rib * (0.7 + 0.5 * smoothstep(0.1, 0.2, abs(phase))) * 6.5 / across * 0.55 * (bonePerMm - lungPerMm);
  }
  return sum;
}

void main() {
  vec2 place = 2.0 * gl_FragCoord.xy / size - 1.0;
  vec3 ray = normalize(distance_ * along + 0.5 * detector * (place.x * right + place.y * up));
  float from = dot(centre - source, along) / dot(ray, along) - reach;
  float step_ = 2.0 * reach / float(steps);
  float sum = 0.0;
  float jitter = hash(gl_FragCoord.xy);
  for (int i = 0; i < steps; i++) {
    vec3 p = source + (from + (float(i) + jitter) * step_) * ray;
    sum += max(heartAt(p), chest * chestAt(p));
  }
  depth = vec4(sum * step_ + chest * ribs(ray), 0.0, 0.0, 1.0);
}`;

export const PICTURE_VERTEX = `
in vec3 position;
in vec2 uv;
uniform mat4 modelViewMatrix, projectionMatrix;
out vec2 place;
void main() {
  place = 2.0 * uv - 1.0;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

/** The detector: the less weakened the brighter, grains of quanta, and the collimator's blades around it. */
export const PICTURE = `${HEAD}
uniform sampler2D depth;
uniform float contrast, brightness, grain, seed;
in vec2 place;
out vec4 colour;

float noise(vec2 p) {
  uvec2 q = uvec2(p + 4096.0);
  uint h = q.x * 0x85EBCA77u ^ q.y * 0xC2B2AE3Du ^ uint(seed) * 0x27D4EB2Fu;
  h ^= h >> 16; h *= 0x7FEB352Du; h ^= h >> 15; h *= 0x846CA68Bu; h ^= h >> 16;
  return float((h & 255u) + ((h >> 8) & 255u) + ((h >> 16) & 255u)) / 382.5 - 1.0;
}

void main() {
  float grey = brightness * exp(-contrast * texture(depth, 0.5 * place + 0.5).r);
  grey *= 1.0 - 0.1 * dot(place, place);
  grey += grain * sqrt(max(grey, 0.02)) * noise(floor(place * 300.0));
  vec2 blade = smoothstep(vec2(0.995), vec2(0.955), abs(place));
  float corner = smoothstep(1.30, 1.24, length(place));
  colour = vec4(vec3(mix(0.035, clamp(grey, 0.0, 1.0), blade.x * blade.y * corner)), 1.0);
}`;

/** The catheter's surface, laid onto the picture's plate where the arm sees it. */
export const CATHETER_VERTEX = `
in vec3 position, normal;
in vec2 uv;
uniform mat4 modelViewMatrix, projectionMatrix, pictureFromBox, boxFromPart;
uniform vec3 sourceBox;
uniform float halfSide;
out vec2 place;
out float facing, mm;
void main() {
  vec4 box = boxFromPart * vec4(position, 1.0);
  vec4 seen = pictureFromBox * box;
  place = seen.xy / seen.w;
  facing = dot(normalize(mat3(boxFromPart) * normal), normalize(sourceBox - box.xyz));
  mm = 10.0 * uv.y;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(halfSide * place, 0.0, 1.0);
}`;

/** What is left of the light; multiplied with what is there. Metal near the tip: its end, the array, a ring behind it. */
export const CATHETER = `${HEAD}
uniform float contrast, ghost, plain, arrayMm;
in vec2 place;
in float facing, mm;
out vec4 colour;
void main() {
  if (facing <= 0.0 || any(greaterThan(abs(place), vec2(0.975))) || length(place) > 1.27) discard;
  float weak = 1.85;
  if (plain < 0.5) {
    if (mm < 1.8) weak = 4.2;
    else if (abs(mm - arrayMm) < 2.8) weak = 3.2;
    else if (abs(mm - 11.0) < 0.8 || abs(mm - 14.0) < 0.8) weak = 3.8;
  }
  if (ghost > 0.5) {
    if (plain < 0.5 && fract(mm / 5.0) > 0.62) discard;
    weak *= 0.5;
  }
  colour = vec4(vec3(exp(-contrast * weak * mix(0.45, 1.0, sqrt(facing)))), 1.0);
}`;
