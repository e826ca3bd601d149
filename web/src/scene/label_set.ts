/** Labels that are made anew together, and let go together. */

import type { Group, Sprite, Vector3 } from "three";
import { makeLabel, RANK } from "./label";
import type { Rank } from "./label";

/** Of a label over what it names. */
const ABOVE_MM = 4;

export class LabelSet {
  private labels: Sprite[] = [];

  constructor(private readonly group: Group) {}

  /** Adds words over a ball at a place, mm. */
  add(words: string, ink: string, rank: Rank, at: Vector3, radiusMm: number): void {
    const label = makeLabel(words, ink, rank);
    if (rank === RANK.active) label.material.depthTest = false; // the ultrasound's plane would hide it
    label.position.copy(at).setZ(at.z + radiusMm + ABOVE_MM);
    this.labels.push(label);
    this.group.add(label);
  }

  clear(): void {
    for (const label of this.labels) {
      label.material.map?.dispose();
      label.material.dispose();
      label.removeFromParent();
    }
    this.labels = [];
  }
}
