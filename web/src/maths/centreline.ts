/** The smooth centreline of the drawn catheter: rings along a Catmull-Rom curve, with a frame carried along it. */

import type { Vector3 } from "./pose";
import { rotationInto } from "./pose";

/** Rings of the tube: four for each interval of a 50-point Track. */
export const RINGS = 197;
/** Of these, the rings that round the tip off. */
export const CAP_RINGS = 8;

const FLOATS = 3 * RINGS;

/**
 * Where the tube's rings are, tip first, all mm in `box`. Ring 0 is the tip itself with radius 0; the next ones follow a
 * half sphere, so that the most distal point of the drawing is the tip; the last closes the tube at the entry.
 *
 * `beam` (the tip's x axis made normal to the curve) is carried back along the curve by double reflection (Wang et al.
 * 2008), so that a stripe at angle 0 runs straight along an untwisted tube and shows the roll. `side` completes the frame.
 */
export class Centreline {
  readonly position = new Float64Array(FLOATS);
  /** Unit, from the entry towards the tip. */
  readonly forward = new Float64Array(FLOATS);
  readonly beam = new Float64Array(FLOATS);
  readonly side = new Float64Array(FLOATS);
  /** Radius of each ring, mm. */
  readonly radius = new Float64Array(RINGS);
  /** Distance from the tip along the curve, mm. */
  readonly along = new Float64Array(RINGS);
  /** Sine of the angle between the surface's normal and `forward`: 1 on the tube, less on the rounded tip. */
  readonly lean = new Float64Array(RINGS);
  private readonly rotation = new Float64Array(9);

  /**
   * Recomputes all rings from K = count >= 2 points (x y z after another, mm, box, tip first) and the tip's orientation
   * (quaternion w x y z). Allocates nothing.
   */
  update(points: Float64Array, count: number, orientation: Float64Array, tubeRadius: number): void {
    const last = count - 1;
    const spacing = flatLength(points, count) / last;
    const cap = Math.min(tubeRadius / spacing, last / 2); // in points; a stub shorter than its own cap keeps half a tube
    const tubeRings = RINGS - CAP_RINGS - 1;
    for (let ring = 0; ring < RINGS; ring++) {
      let at: number;
      if (ring < CAP_RINGS) {
        const angle = (ring / CAP_RINGS) * (Math.PI / 2);
        at = cap * (1 - Math.cos(angle));
        this.radius[ring] = tubeRadius * Math.sin(angle);
        this.lean[ring] = Math.sin(angle);
      } else {
        at = cap + ((last - cap) * Math.min(ring - CAP_RINGS, tubeRings - 1)) / (tubeRings - 1);
        this.radius[ring] = ring === RINGS - 1 ? 0 : tubeRadius;
        this.lean[ring] = 1;
      }
      this.evaluate(points, last, at, ring);
    }
    this.measure();
    this.carryFrame(orientation);
  }

  /** Writes position and direction at parameter `at` (0 at the tip, `last` = K - 1 at the entry) to a ring. */
  private evaluate(points: Float64Array, last: number, at: number, ring: number): void {
    const i = Math.min(Math.max(Math.floor(at), 0), last - 1);
    const t = at - i;
    let squared = 0;
    for (let axis = 0; axis < 3; axis++) {
      const from = 3 * i + axis;
      const pb = points[from]!;
      const pc = points[from + 3]!;
      const pa = i > 0 ? points[from - 3]! : 2 * pb - pc;
      const pd = i + 2 <= last ? points[from + 6]! : 2 * pc - pb;
      const linear = 0.5 * (pc - pa);
      const square = pa - 2.5 * pb + 2 * pc - 0.5 * pd;
      const cube = 0.5 * (pd - pa) + 1.5 * (pb - pc);
      this.position[3 * ring + axis] = pb + t * (linear + t * (square + t * cube));
      const slope = linear + t * (2 * square + t * 3 * cube);
      this.forward[3 * ring + axis] = -slope;
      squared += slope * slope;
    }
    const scale = squared > 0 ? 1 / Math.sqrt(squared) : 0;
    for (let axis = 0; axis < 3; axis++) this.forward[3 * ring + axis]! *= scale;
  }

  private measure(): void {
    const p = this.position;
    this.along[0] = 0;
    for (let ring = 1; ring < RINGS; ring++) {
      const at = 3 * ring;
      const dx = p[at]! - p[at - 3]!, dy = p[at + 1]! - p[at - 2]!, dz = p[at + 2]! - p[at - 1]!;
      const step = Math.sqrt(dx * dx + dy * dy + dz * dz); // Math.hypot allocates
      this.along[ring] = this.along[ring - 1]! + step;
    }
  }

  private carryFrame(orientation: Float64Array): void {
    rotationInto(this.rotation, orientation);
    this.setBeam(0, this.rotation[0]!, this.rotation[3]!, this.rotation[6]!);
    for (let ring = 0; ring < RINGS - 1; ring++) this.carryTo(ring + 1);
  }

  /** One step of double reflection, from the ring before to `ring`. */
  private carryTo(ring: number): void {
    const { position: p, forward: f, beam: n } = this;
    const a = 3 * (ring - 1);
    const b = 3 * ring;
    let nx = n[a]!, ny = n[a + 1]!, nz = n[a + 2]!;
    let fx = f[a]!, fy = f[a + 1]!, fz = f[a + 2]!;
    const cx = p[b]! - p[a]!, cy = p[b + 1]! - p[a + 1]!, cz = p[b + 2]! - p[a + 2]!;
    const chord = cx * cx + cy * cy + cz * cz;
    if (chord > 1e-18) {
      const onN = (2 / chord) * (cx * nx + cy * ny + cz * nz);
      const onF = (2 / chord) * (cx * fx + cy * fy + cz * fz);
      nx -= onN * cx; ny -= onN * cy; nz -= onN * cz;
      fx -= onF * cx; fy -= onF * cy; fz -= onF * cz;
      const mx = f[b]! - fx, my = f[b + 1]! - fy, mz = f[b + 2]! - fz;
      const second = mx * mx + my * my + mz * mz;
      if (second > 1e-18) {
        const on = (2 / second) * (mx * nx + my * ny + mz * nz);
        nx -= on * mx; ny -= on * my; nz -= on * mz;
      }
    }
    this.setBeam(ring, nx, ny, nz);
  }

  /** Stores a ring's beam direction, made normal to the curve, and the side direction forward x beam. */
  private setBeam(ring: number, nx: number, ny: number, nz: number): void {
    const at = 3 * ring;
    const fx = this.forward[at]!, fy = this.forward[at + 1]!, fz = this.forward[at + 2]!;
    const along = nx * fx + ny * fy + nz * fz;
    let x = nx - along * fx, y = ny - along * fy, z = nz - along * fz;
    let length = Math.sqrt(x * x + y * y + z * z);
    if (length < 1e-9) { // parallel: any normal will do, so that the tube stays a tube
      if (Math.abs(fx) < 0.9) { x = 1 - fx * fx; y = -fx * fy; z = -fx * fz; }
      else { x = -fy * fx; y = 1 - fy * fy; z = -fy * fz; }
      length = Math.sqrt(x * x + y * y + z * z) || 1;
    }
    x /= length; y /= length; z /= length;
    this.beam[at] = x; this.beam[at + 1] = y; this.beam[at + 2] = z;
    this.side[at] = fy * z - fz * y;
    this.side[at + 1] = fz * x - fx * z;
    this.side[at + 2] = fx * y - fy * x;
  }
}

/** Returns the length of a polyline of `count` points, x y z after another, in its own unit. */
export function flatLength(points: Float64Array, count: number): number {
  let length = 0;
  for (let i = 3; i < 3 * count; i += 3) {
    const x = points[i]! - points[i - 3]!, y = points[i + 1]! - points[i - 2]!, z = points[i + 2]! - points[i - 1]!;
    length += Math.sqrt(x * x + y * y + z * z);
  }
  return length;
}

/** Returns the length of a polyline, in its own unit. */
export function polylineLength(points: readonly Vector3[]): number {
  let length = 0;
  for (let i = 1; i < points.length; i++) {
    const a = points[i - 1]!;
    const b = points[i]!;
    length += Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
  }
  return length;
}
