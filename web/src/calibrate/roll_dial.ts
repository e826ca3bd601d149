/** How roll lies on the dial: seen from the handle towards the box, so that positive roll is clockwise. */

import type { RollCalibrationState } from "../generated/messages";

const FULL_TURN = 2 * Math.PI;
const TEETH = 48;

export interface Point {
  readonly x: number;
  readonly y: number;
}

/** Returns the point of the dial at an angle, clockwise from the right, at a radius; y downwards. */
export function at(angle: number, radius: number): Point {
  return { x: radius * Math.cos(angle), y: radius * Math.sin(angle) };
}

/** Returns an SVG path for what was turned from `from` on, at most one turn of it, either way round. */
export function arcPath(from: number, turned: number, radius: number): string {
  const span = Math.max(-0.9999 * FULL_TURN, Math.min(0.9999 * FULL_TURN, turned));
  const start = at(from, radius);
  const end = at(from + span, radius);
  const large = Math.abs(span) > Math.PI ? 1 : 0;
  const sweep = span > 0 ? 1 : 0;
  return `M${fixed(start)}A${radius} ${radius} 0 ${large} ${sweep} ${fixed(end)}`;
}

/** Returns the outline of a gear as an SVG path. */
export function gearPath(root: number, tip: number): string {
  const parts: string[] = [];
  for (let tooth = 0; tooth < TEETH; tooth += 1) {
    for (const [share, radius] of [[0, root], [0.28, root], [0.4, tip], [0.68, tip], [0.8, root]] as const) {
      parts.push(fixed(at(((tooth + share) / TEETH) * FULL_TURN, radius)));
    }
  }
  return `M${parts.join("L")}Z`;
}

/** Returns where the encoder's gear stands in its range, 0 … 1, and how wide that is in degrees. */
export function rocked(state: RollCalibrationState): { share: number; widthDeg: number; wide: boolean } | null {
  const { rocking, turned_rad: turned } = state;
  if (rocking === null || turned === null) return null;
  const width = rocking.high_rad - rocking.low_rad;
  const share = width > 0 ? Math.max(0, Math.min(1, (turned - rocking.low_rad) / width)) : 0.5;
  return { share, widthDeg: degrees(width), wide: width > rocking.limit_rad };
}

export function degrees(rad: number): number {
  return (rad * 180) / Math.PI;
}

function fixed({ x, y }: Point): string {
  return `${x.toFixed(2)} ${y.toFixed(2)}`;
}
