/** The passes of the ultrasound image in GLSL ES 3.00. src/cathxr/ultrasound is the same in Python, and the reference. */

export const FULL_SCREEN = `
in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`;

const HEAD = `
precision highp float;
precision highp int;
precision highp sampler3D;
`;

/** Geometry of the lines, and where a point of the frame \`transducer\` (mm) is in the volume (voxels). */
const PLANE = `
uniform highp sampler3D volume;
uniform vec3 origin, axisX, axisY, axisZ, spacing, voxels;
uniform float ctPerMm, sector, depth, apex;
uniform float interfaceMm, scatterMax, attenuationMax, interfaceMax;
vec3 voxelAt(float reach, float angle) {
  return origin + (reach * cos(angle) - apex) * axisX + reach * sin(angle) * axisZ;
}
vec4 codesAt(vec3 voxel) { return texture(volume, (voxel + 0.5) / voxels); }
`;

const HASH = `
uint mixed(uint h) {
  h ^= h >> 16; h *= 0x7FEB352Du;
  h ^= h >> 15; h *= 0x846CA68Bu;
  return h ^ (h >> 16);
}
uint latticeKey(ivec3 p) {
  return uint(p.x) * 0x85EBCA77u + uint(p.y) * 0xC2B2AE3Du + uint(p.z) * 0x27D4EB2Fu;
}
vec2 deviate(uint h) {
  return vec2(float((h & 255u) + ((h >> 8) & 255u)), float(((h >> 16) & 255u) + (h >> 24))) - 255.0;
}
const float UNIT = 147.80054127099798;
`;

/** Two-way loss in dB up to the middle of each range cell: attenuation, and what interfaces keep back. */
export const LOSS = `${HEAD}${PLANE}
uniform float frequency;
uniform vec2 size;
out vec4 lossDb;
void main() {
  float angle = (gl_FragCoord.x / size.x - 0.5) * sector;
  int own = int(gl_FragCoord.y);
  float cell = depth / size.y;
  float passed = 0.0;
  for (int i = 0; i <= own; i++) {
    vec4 code = codesAt(voxelAt(apex + (float(i) + 0.5) * cell, angle));
    float halfJump = interfaceMax * code.a * code.a * interfaceMm;
    float lost = 0.2 * attenuationMax * code.b * code.b * frequency
      + 2.0 * 8.685889638065037 * log(cosh(halfJump)) * 1.4142135623730951 / interfaceMm * ctPerMm;
    passed += lost * cell * (i == own ? 0.5 : 1.0);
  }
  lossDb = vec4(min(passed, 60000.0), 0.0, 0.0, 1.0);
}`;

/** The echo of each point, real and imaginary, times ECHO_SCALE so that half floats hold it. */
export const ECHO = `${HEAD}${PLANE}${HASH}
uniform sampler2D loss;
uniform vec2 size;
uniform float incidencePower, cellMm, correlationMm, sigmaAxialMm, sigmaLateralRad, myocardium, echoScale, narrowing, wallGain;
uniform int slices, layers;
out vec4 echo;

/** The scatterer field at a point in cells: linear between the lattice's points, of the same variance anywhere. */
vec2 scatterersAt(vec3 p) {
  vec3 base = floor(p);
  vec3 f = p - base;
  ivec3 at = ivec3(base);
  vec2 sum = vec2(0.0);
  for (int corner = 0; corner < 8; corner++) {
    ivec3 d = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    vec3 w = mix(1.0 - f, f, vec3(d));
    sum += w.x * w.y * w.z * deviate(mixed(latticeKey(at + d)));
  }
  vec3 squares = f * f + (1.0 - f) * (1.0 - f);
  return sum * inversesqrt(squares.x * squares.y * squares.z);
}

vec3 slopeAt(vec3 voxel) {
  vec2 reach = vec2(1.25, 0.0);
  vec3 slope = vec3(
    codesAt(voxel + reach.xyy).r - codesAt(voxel - reach.xyy).r,
    codesAt(voxel + reach.yxy).r - codesAt(voxel - reach.yxy).r,
    codesAt(voxel + reach.yyx).r - codesAt(voxel - reach.yyx).r) / spacing;
  return slope / max(length(slope), 1e-6);
}

/** A wall's echo from the interface's code one standard deviation before a point, there, and beyond. */
float wallOf(float before, float here, float beyond) {
  float place = clamp(log((before + 0.00196078431) / (beyond + 0.00196078431)), -2.0, 2.0);
  float reflection = tanh(interfaceMax * interfaceMm * here * here * exp(0.5 * place * place));
  return reflection * exp(-0.5 * narrowing * narrowing * place * place);
}

void main() {
  float lineRad = sector / size.x;
  float angle = (gl_FragCoord.x / size.x - 0.5) * sector;
  float r = gl_FragCoord.y / size.y * depth;
  float reach = apex + r;
  vec3 voxel = voxelAt(reach, angle);
  vec3 beam = (cos(angle) * axisX + sin(angle) * axisZ) * spacing / ctPerMm;

  vec3 normal = slopeAt(voxel);
  vec3 across = normal * interfaceMm / 2.5066282746310002 / spacing;
  float scatter = 0.0, wall = 0.0;
  vec3 aside = axisY * 1.2247448713915890 * sqrt(0.25 + 0.000484 * r * r);
  for (int i = 0; i < slices; i++) {
    vec3 at = slices == 3 ? voxel + float(i - 1) * aside : voxel;
    vec4 code = codesAt(at);
    scatter += scatterMax * code.g * code.g;
    wall += wallOf(codesAt(at - across).a, code.a, codesAt(at + across).a);
  }

  vec3 layer = 1.4 * axisY * spacing / ctPerMm;
  float apart = reach * lineRad * ctPerMm;
  int parts = clamp(int(ceil(apart / cellMm)), 1, 4);
  vec2 sum = vec2(0.0);
  for (int i = 0; i < parts; i++) {
    float turned = angle + ((float(i) + 0.5) / float(parts) - 0.5) * lineRad;
    vec3 place = voxelAt(reach, turned) * spacing / cellMm - 0.5 * float(layers - 1) * layer;
    for (int j = 0; j < layers; j++) sum += scatterersAt(place + float(j) * layer);
  }
  sum /= UNIT * float(parts) * sqrt(float(layers));
  float lateral = reach * sigmaLateralRad * ctPerMm;
  float width = lateral * lateral + apart * apart * (1.0 - 1.0 / float(parts * parts)) / 12.0;
  float axial = sigmaAxialMm * ctPerMm / correlationMm;
  float gain = sqrt(sqrt((1.0 + 2.0 * axial * axial) * (1.0 + 2.0 * width / (correlationMm * correlationMm))));

  float passed = exp2(-0.16609640474436813 * texture(loss, gl_FragCoord.xy / size).r);
  vec2 total = scatter * myocardium * gain * sum;
  total.x += wall * wallGain * pow(min(abs(dot(normal, beam)), 1.0), incidencePower);
  echo = vec4(echoScale * passed / float(slices) * total, 0.0, 1.0);
}`;
// mind: scatter and wall are sums over the slices there, and are divided by their number at the end

const BLUR = `
uniform sampler2D echo;
uniform float weights[16];
uniform int radius;
/** The weighted mean along a step; at the edges, of what is there. */
vec2 blurred(ivec2 at, ivec2 step, int place, int end) {
  vec2 sum = vec2(0.0);
  float total = 0.0;
  for (int i = max(-radius, -place); i <= min(radius, end - 1 - place); i++) {
    float weight = weights[abs(i)];
    sum += weight * texelFetch(echo, at + i * step, 0).rg;
    total += weight;
  }
  return sum / total;
}
`;

/** The pulse's length: blurs along the lines. */
export const AXIAL = `${HEAD}${BLUR}
uniform vec2 size;
out vec4 result;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  result = vec4(blurred(at, ivec2(0, 1), at.y, int(size.y)), 0.0, 1.0);
}`;

/**
 * The beam's width, constant in angle, then the receiver: envelope, ring, noise, amplification, compression. `fresh`: the
 * share of this picture where it is mixed with the one before.
 */
export const RECEIVE = `${HEAD}${BLUR}${HASH}
uniform vec2 size;
uniform float depth, echoScale, noise, ring, gainDb, tgcTotalDb, whiteDb, dynamicRangeDb, fresh;
uniform float tgc[8];
uniform int seq;
out vec4 grey;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec2 received = blurred(at, ivec2(1, 0), at.x, int(size.x)) / echoScale;
  received += noise / UNIT * deviate(mixed(mixed(latticeKey(ivec3(at, seq))) ^ 0x3C6EF372u));
  float share = gl_FragCoord.y / size.y;
  float r = share * depth;
  float rung = ring * exp(-r / 1.1) * (0.6 + 0.4 * cos(6.283185307179586 * r / 0.9));
  float envelope = sqrt(dot(received, received) + rung * rung);
  int stop = min(int(share * 7.0), 6);
  float amplified = gainDb + tgcTotalDb * share + mix(tgc[stop], tgc[stop + 1], share * 7.0 - float(stop));
  float levelDb = 6.020599913279624 * log2(max(envelope, 1e-12)) + amplified;
  grey = vec4(vec3(clamp(1.0 + (levelDb - whiteDb) / dynamicRangeDb, 0.0, 1.0)), fresh);
}`;

export const FAN_VERTEX = `
in vec3 position;
uniform mat4 modelViewMatrix, projectionMatrix;
out vec2 place;
void main() {
  place = position.xz;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

/** The sector, drawn from the polar picture: one look-up a pixel, and one more where parts are coloured. */
export const FAN = `${HEAD}
precision highp usampler3D;
uniform sampler2D picture, palette;
uniform highp usampler3D labels;
uniform mat4 labelsFromTransducer;
uniform float sector, depth, apex, opacity, colouring;
in vec2 place;
out vec4 colour;
void main() {
  vec2 lines = vec2(place.x + apex, place.y);
  vec2 at = vec2(atan(lines.y, lines.x) / sector + 0.5, (length(lines) - apex) / depth);
  if (at.x < 0.0 || at.x > 1.0 || at.y < 0.0 || at.y > 1.0) discard;
  float grey = texture(picture, at).r;
  vec3 shown = vec3(grey);
  if (colouring > 0.0) {
    ivec3 voxel = ivec3(floor((labelsFromTransducer * vec4(place.x, 0.0, place.y, 1.0)).xyz + 0.5));
    if (all(greaterThanEqual(voxel, ivec3(0))) && all(lessThan(voxel, textureSize(labels, 0)))) {
      vec4 part = texelFetch(palette, ivec2(int(texelFetch(labels, voxel, 0).r), 0), 0);
      shown = mix(shown, part.rgb * (0.5 + 0.5 * grey) + 0.25 * grey, colouring * part.a);
    }
  }
  colour = vec4(shown, opacity);
}`;
