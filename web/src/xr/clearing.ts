/** Where in the view there is room: elevations that nothing else takes. Pure geometry, angles as seen from the head, rad. */

import { Quaternion, Vector3 } from "three";
import type { Plate } from "../flat/plate";
import type { Head } from "./placement";

const MOST = 12;
/** Kept free between two things. */
const GAP_RAD = (2.5 * Math.PI) / 180;
const LOWEST_RAD = (-80 * Math.PI) / 180;
const HIGHEST_RAD = (60 * Math.PI) / 180;
const work = { way: new Vector3(), size: new Vector3(), turn: new Quaternion() };

export class Clearing {
  /** Azimuth (to the right positive, from -z), elevation, and half of the size in both. */
  private readonly taken = new Float64Array(4 * MOST);
  private count = 0;
  private readonly head = new Vector3();

  /** Forgets what was there, and takes where the head is. */
  begin(head: Head): void {
    this.count = 0;
    this.head.copy(head.position);
  }

  /** Says that a ball is there; metres, in the room. One that surrounds the head takes nothing. */
  ball(centre: Vector3, radius: number): void {
    const distance = work.way.subVectors(centre, this.head).length();
    if (distance <= 1.2 * radius) return;
    const half = Math.asin(radius / distance);
    this.take(work.way, half, half);
  }

  /** Says that a plate is there, which faces the head more or less. */
  plate(plate: Plate): void {
    plate.group.matrixWorld.decompose(work.way, work.turn, work.size);
    work.way.sub(this.head);
    const distance = Math.max(0.05, work.way.length());
    this.take(work.way, Math.atan((plate.widthM * work.size.x) / 2 / distance), Math.atan((plate.heightM * work.size.y) / 2 / distance));
  }

  /** Whether something is where a thing of some half width and height would be. */
  blocked(azimuth: number, elevation: number, halfWidth: number, halfHeight: number): boolean {
    for (let i = 0; i < this.count; i++) {
      if (this.beside(i, azimuth, halfWidth)) continue;
      if (Math.abs(elevation - this.taken[4 * i + 1]!) < this.taken[4 * i + 3]! + halfHeight) return true;
    }
    return false;
  }

  /** Returns the elevation nearest to the one wanted that is free; where none is, the one wanted. */
  nearest(azimuth: number, elevation: number, halfWidth: number, halfHeight: number): number {
    if (!this.blocked(azimuth, elevation, halfWidth, halfHeight)) return elevation;
    let [best, least] = [elevation, Infinity];
    for (let i = 0; i < this.count; i++) {
      if (this.beside(i, azimuth, halfWidth)) continue;
      for (let sign = -1; sign <= 1; sign += 2) {
        const at = this.taken[4 * i + 1]! + sign * (this.taken[4 * i + 3]! + halfHeight + GAP_RAD);
        const away = Math.abs(at - elevation);
        if (away >= least || at < LOWEST_RAD || at > HIGHEST_RAD || this.blocked(azimuth, at, halfWidth, halfHeight)) continue;
        best = at;
        least = away;
      }
    }
    return best;
  }

  private beside(index: number, azimuth: number, halfWidth: number): boolean {
    const away = azimuth - this.taken[4 * index]!;
    return Math.abs(away - 2 * Math.PI * Math.round(away / (2 * Math.PI))) >= this.taken[4 * index + 2]! + halfWidth;
  }

  private take(way: Vector3, halfWidth: number, halfHeight: number): void {
    if (this.count === MOST) return;
    const to = 4 * this.count++;
    const elevation = elevationOf(way);
    this.taken[to] = azimuthOf(way);
    this.taken[to + 1] = elevation;
    this.taken[to + 2] = halfWidth / Math.max(0.2, Math.cos(elevation)); // degrees of azimuth are shorter above and below
    this.taken[to + 3] = halfHeight;
  }
}

export function azimuthOf(way: Vector3): number {
  return Math.atan2(way.x, -way.z);
}

export function elevationOf(way: Vector3): number {
  return Math.atan2(way.y, Math.hypot(way.x, way.z));
}
