/** An X-ray arm: how a point of the patient comes to be where in the picture. Angles as DICOM's positioner angles have them. */

import { Matrix4, Vector3 } from "three";
import type { ArmAngles, Biplane, Change, SceneSettings } from "../stage/settings";

/** From the focal spot to the detector, and to the isocentre, mm: usual of a cardiac system. */
export const SOURCE_DETECTOR_MM = 1100;
export const SOURCE_ISOCENTRE_MM = 750;
/** Side of the detector's square that is shown, mm: 150 mm at the isocentre. */
export const DETECTOR_MM = 220;
export const MAGNIFICATION = SOURCE_DETECTOR_MM / SOURCE_ISOCENTRE_MM;
/** What the picture shows at the isocentre, mm. */
export const FIELD_MM = DETECTOR_MM / MAGNIFICATION;

export interface ArmPreset {
  readonly name: string;
  /** As it stands on a small button, in one or two lines. */
  readonly short: readonly string[];
  readonly angles: ArmAngles;
}

export const ARM_PRESETS: readonly ArmPreset[] = [
  { name: "AP", short: ["AP"], angles: { laoDeg: 0, cranialDeg: 0 } },
  { name: "RAO 30", short: ["RAO 30"], angles: { laoDeg: -30, cranialDeg: 0 } },
  { name: "LAO 45", short: ["LAO 45"], angles: { laoDeg: 45, cranialDeg: 0 } },
  { name: "LAO 60", short: ["LAO 60"], angles: { laoDeg: 60, cranialDeg: 0 } },
  { name: "Lateral", short: ["LAT"], angles: { laoDeg: 90, cranialDeg: 0 } },
  { name: "RAO 30 CAU 20", short: ["RAO 30", "CAU 20"], angles: { laoDeg: -30, cranialDeg: -20 } },
  { name: "LAO 45 CRA 20", short: ["LAO 45", "CRA 20"], angles: { laoDeg: 45, cranialDeg: 20 } },
];

/** The two arms of each pair of views. */
export const BIPLANES: Readonly<Record<Exclude<Biplane, "own">, readonly [ArmAngles, ArmAngles]>> = {
  ap: [{ laoDeg: 0, cranialDeg: 0 }, { laoDeg: 90, cranialDeg: 0 }],
  oblique: [{ laoDeg: -30, cranialDeg: 0 }, { laoDeg: 45, cranialDeg: 0 }],
};

/** Returns what keeps the arms and the name of their pair together after a change of either; null: they are. */
export function paired(now: SceneSettings, before: SceneSettings): Change | null {
  const pair = now.biplane === "own" ? null : BIPLANES[now.biplane];
  if (pair === null || pair.every((angles, arm) => sameArm(angles, now.arms[arm]!))) return null;
  return now.biplane !== before.biplane ? { arms: pair } : { biplane: "own" };
}

/**
 * The axes of an arm in `ct` (DICOM LPS: x to the patient's left, y posterior, z to the head; the patient lies supine).
 * Primary angle: like a longitude, right anterior oblique negative, left positive; secondary: like a latitude, caudal
 * negative, cranial positive.
 */
export class ArmAxes {
  /** From the focal spot to the detector, unit. */
  readonly beam = new Vector3();
  /** To the right of the picture, which is seen from the detector's side: the patient's left at AP. */
  readonly right = new Vector3();
  /** To the top of the picture. */
  readonly up = new Vector3();

  /** Takes angles in degrees. */
  set({ laoDeg, cranialDeg }: ArmAngles): this {
    const [lao, cranial] = [(laoDeg * Math.PI) / 180, (cranialDeg * Math.PI) / 180];
    const [sl, cl, sc, cc] = [Math.sin(lao), Math.cos(lao), Math.sin(cranial), Math.cos(cranial)];
    this.beam.set(sl * cc, -cl * cc, sc);
    this.right.set(cl, sl, 0);
    this.up.set(-sl * sc, cl * sc, cc);
    return this;
  }
}

/**
 * Writes what takes a point in `ct`, mm, to the picture: x and y over w are -1 to 1 from left to right and from bottom to
 * top, w is the distance from the focal spot along the central ray, mm, and z is w times the share of the way to the
 * detector. The central ray goes through the isocentre.
 */
export function pictureFromCt(out: Matrix4, axes: ArmAxes, isocentre: Vector3): Matrix4 {
  const { beam: d, right: u, up: v } = axes;
  const f = (2 * SOURCE_DETECTOR_MM) / DETECTOR_MM;
  const sx = isocentre.x - SOURCE_ISOCENTRE_MM * d.x;
  const sy = isocentre.y - SOURCE_ISOCENTRE_MM * d.y;
  const sz = isocentre.z - SOURCE_ISOCENTRE_MM * d.z;
  const along = (axis: Vector3): number => axis.x * sx + axis.y * sy + axis.z * sz;
  const z = 1 / SOURCE_DETECTOR_MM;
  return out.set(
    f * u.x, f * u.y, f * u.z, -f * along(u),
    f * v.x, f * v.y, f * v.z, -f * along(v),
    z * d.x, z * d.y, z * d.z, -z * along(d),
    d.x, d.y, d.z, -along(d),
  );
}

/** Returns the angles as a cath lab writes them, for example `LAO 45  CRA 0`, in degrees. */
export function armText({ laoDeg, cranialDeg }: ArmAngles): string {
  const lao = Math.round(laoDeg);
  const cranial = Math.round(cranialDeg);
  return `${lao < 0 ? "RAO" : "LAO"} ${Math.abs(lao)}  ${cranial < 0 ? "CAU" : "CRA"} ${Math.abs(cranial)}`;
}

/** Returns the letter of the patient's side that a direction in LPS points to most, or both where it is oblique. */
export function sideLetters(direction: Vector3): string {
  const sides: [number, string][] = [
    [Math.abs(direction.x), direction.x > 0 ? "L" : "R"],
    [Math.abs(direction.y), direction.y > 0 ? "P" : "A"],
    [Math.abs(direction.z), direction.z > 0 ? "H" : "F"],
  ];
  return sides.sort((a, b) => b[0] - a[0]).filter(([size], at) => at < 2 && size > 0.35).map(([, letter]) => letter).join("");
}

export function sameArm(a: ArmAngles, b: ArmAngles): boolean {
  return a.laoDeg === b.laoDeg && a.cranialDeg === b.cranialDeg;
}
