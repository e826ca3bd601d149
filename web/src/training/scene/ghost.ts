/** A run shown again: the tip's way as beads coloured by time, and a ghost of the catheter that moves along it. */

import {
  BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, IcosahedronGeometry, InstancedMesh, Matrix4, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, Quaternion, SRGBColorSpace, Vector3,
} from "three";
import type { SceneDescription } from "../../generated/messages";
import { Centreline } from "../../maths/centreline";
import { makeTubeArrays, tubeIndices, writeTube } from "../../maths/tube";
import type { Feature, Frame } from "../../stage/feature";
import type { Stage } from "../../stage/stage";
import { beads, timeColour } from "../time_colours";

const MOST_POINTS = 200;
const MOST_BEADS = 1600;
const BEAD_MM = 0.55;
const APART_MM = 0.8;
const GHOST = 0x9fd8ff;
const ORDER = 33;
const work = { x: new Vector3(), y: new Vector3(), z: new Vector3(), matrix: new Matrix4(), turn: new Quaternion() };

export class Ghost implements Feature {
  private readonly group = new Group();
  private readonly geometry = new BufferGeometry();
  private readonly arrays = makeTubeArrays();
  private readonly line = new Centreline();
  private readonly tube: Mesh<BufferGeometry, MeshLambertMaterial>;
  private readonly points = new Float64Array(3 * MOST_POINTS);
  private readonly orientation = new Float64Array(4);
  private way: InstancedMesh<IcosahedronGeometry, MeshBasicMaterial> | null = null;
  private version = 0;
  private drawnS = NaN;
  private radius = 1.5;

  constructor(private readonly stage: Stage) {
    for (const name of ["position", "normal"] as const) {
      this.geometry.setAttribute(name, new BufferAttribute(this.arrays[name], 3).setUsage(DynamicDrawUsage));
    }
    this.geometry.setIndex(new BufferAttribute(tubeIndices(), 1));
    this.tube = new Mesh(this.geometry, new MeshLambertMaterial({ color: GHOST, transparent: true, opacity: 0.72 }));
    this.tube.frustumCulled = false;
    this.tube.renderOrder = ORDER;
    this.group.name = "run";
    this.group.add(this.tube);
    this.group.visible = false;
    stage.view.box.add(this.group);
  }

  describe(scene: SceneDescription): void {
    this.radius = scene.catheter_diameter_mm / 2;
  }

  update(frame: Frame): boolean {
    const { replay, catheter } = this.stage;
    const { player } = replay;
    if (replay.version !== this.version) {
      this.version = replay.version;
      this.group.visible = player !== null;
      catheter.faded = player !== null;
      this.layWay();
      this.drawnS = NaN;
    } else if (player === null) {
      return false;
    }
    if (player === null) return true;
    player.step(frame.dtS);
    if (player.timeS === this.drawnS) return false;
    this.drawnS = player.timeS;
    const count = player.shapeAt(this.points);
    this.tube.visible = count >= 2;
    if (!this.tube.visible) return true;
    this.turn(player.beamAt());
    this.line.update(this.points, count, this.orientation, this.radius);
    writeTube(this.arrays, this.line);
    this.geometry.attributes["position"]!.needsUpdate = this.geometry.attributes["normal"]!.needsUpdate = true;
    return true;
  }

  /** Writes the tip's orientation from where the catheter points and where the beam looks. */
  private turn(beam: readonly [number, number, number] | null): void {
    const { x, y, z, matrix, turn } = work;
    const p = this.points;
    z.set(p[0]! - p[3]!, p[1]! - p[4]!, p[2]! - p[5]!).normalize();
    if (beam === null) x.set(0, -1, 0);
    else x.set(beam[0], beam[1], beam[2]);
    x.addScaledVector(z, -x.dot(z));
    if (x.lengthSq() < 1e-9) x.set(z.y, -z.x, 0);
    x.normalize();
    y.crossVectors(z, x);
    turn.setFromRotationMatrix(matrix.makeBasis(x, y, z));
    this.orientation[0] = turn.w;
    this.orientation[1] = turn.x;
    this.orientation[2] = turn.y;
    this.orientation[3] = turn.z;
  }

  /** Lays the beads of another run, or takes them away. */
  private layWay(): void {
    this.way?.removeFromParent();
    this.way?.geometry.dispose();
    this.way?.material.dispose();
    this.way?.dispose();
    this.way = null;
    const { player } = this.stage.replay;
    if (player === null) return;
    const { tip, t } = player.path;
    const shown = beads(tip, APART_MM, MOST_BEADS);
    if (shown.length === 0) return;
    const way = new InstancedMesh(new IcosahedronGeometry(BEAD_MM, 1), new MeshBasicMaterial({ transparent: true, opacity: 0.95 }), shown.length);
    const colour = new Color();
    const rgb = [0, 0, 0];
    shown.forEach((sample, i) => {
      const [x, y, z] = tip[sample]!;
      way.setMatrixAt(i, work.matrix.makeTranslation(x, y, z));
      timeColour(rgb, 0, player.durationS > 0 ? t[sample]! / player.durationS : 0);
      way.setColorAt(i, colour.setRGB(rgb[0]!, rgb[1]!, rgb[2]!, SRGBColorSpace));
    });
    way.frustumCulled = false;
    way.renderOrder = ORDER - 1;
    this.group.add(way);
    this.way = way;
  }
}
