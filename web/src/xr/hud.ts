/** The numbers that stay in view, and the large words when the link is lost: plates that follow the head lazily. */

import { Quaternion, Vector3 } from "three";
import type { Line, NoticeWords, Tone } from "./hud_words";
import { box, CanvasPlate, INK, PLATE_ORDER, write } from "./canvas_plate";
import type { Clearing } from "./clearing";
import { azimuthOf, elevationOf } from "./clearing";
import { facing } from "./interaction";
import type { Head } from "./placement";

const WIDTH = 350;
const LINE = 36;
const LINES = 5;
const MARGIN = 14;
/** Capitals are 1.1 degrees high at the distance below. */
const EM = 23;
const AHEAD_M = 0.82;
const DOWN_RAD = (21 * Math.PI) / 180;
/** Nothing moves until the head has turned this far; then it comes along until it is back in place. */
const SLACK_RAD = (13 * Math.PI) / 180;
const CLOSE_RAD = (1.5 * Math.PI) / 180;
const FOLLOW_S = 0.28;
const COLOUR: Readonly<Record<Tone, string>> = {
  idle: INK.idle, good: INK.good, warn: INK.warn, bad: INK.bad, text: INK.text, soft: INK.soft,
};
const work = { wanted: new Vector3(), direction: new Vector3(), present: new Vector3(), turn: new Quaternion() };

/** Keeps a plate at a place relative to the head, without shaking with it. */
export class LazyFollower {
  private following = true;
  private readonly wanted = new Vector3();

  constructor(private readonly aheadM: number, private readonly downRad: number) {}

  /** Goes there at once at the next update. */
  jump(): void {
    this.following = true;
    this.wanted.set(0, 0, 0);
  }

  /** room: where there is room for it; null: it goes before everything. */
  update(plate: CanvasPlate, head: Head, dtS: number, room: Clearing | null): void {
    const first = this.wanted.lengthSq() === 0;
    const { position } = plate.group;
    work.direction.set(0, -Math.sin(this.downRad), -Math.cos(this.downRad)).applyQuaternion(head.orientation);
    const blocked = room !== null && this.keepClear(plate, head, room);
    this.wanted.copy(head.position).addScaledVector(work.direction, this.aheadM);
    work.present.subVectors(position, head.position);
    const away = work.present.lengthSq() < 1e-9 ? Math.PI : work.present.angleTo(work.direction);
    const distance = work.present.length();
    if (blocked || away > SLACK_RAD || Math.abs(distance / this.aheadM - 1) > 0.25) this.following = true;
    else if (away < CLOSE_RAD) this.following = false;
    if (first) position.copy(this.wanted);
    else if (this.following) position.lerp(this.wanted, 1 - Math.exp(-dtS / FOLLOW_S));
    plate.group.quaternion.copy(facing(work.turn, position, head.position));
    plate.group.updateMatrixWorld(true);
  }

  /** Turns the wanted direction up or down to where nothing is; returns whether something is where the plate is now. */
  private keepClear(plate: CanvasPlate, head: Head, room: Clearing): boolean {
    const halfHeight = Math.atan(plate.heightM / 2 / this.aheadM);
    const azimuth = azimuthOf(work.direction);
    const wanted = elevationOf(work.direction);
    const halfWidth = Math.atan(plate.widthM / 2 / this.aheadM) / Math.max(0.2, Math.cos(wanted));
    const free = room.nearest(azimuth, wanted, halfWidth, halfHeight);
    if (free !== wanted) work.direction.set(Math.sin(azimuth) * Math.cos(free), Math.sin(free), -Math.cos(azimuth) * Math.cos(free));
    work.present.subVectors(plate.group.position, head.position);
    return room.blocked(azimuthOf(work.present), elevationOf(work.present), halfWidth, halfHeight);
  }
}

export class Hud extends CanvasPlate {
  readonly follower = new LazyFollower(AHEAD_M, DOWN_RAD);
  private lines: readonly Line[] = [];
  private shown = "";

  constructor() {
    super("numbers", WIDTH, LINES * LINE + 2 * 6, 1.6, PLATE_ORDER - 2);
  }

  get text(): string {
    return this.lines.map(({ left, right }) => `${left.text} | ${right?.text ?? ""}`).join("\n");
  }

  /** Takes what to say; draws only when that is something else. */
  say(lines: readonly Line[]): void {
    const text = JSON.stringify(lines);
    if (text === this.shown) return;
    this.shown = text;
    this.lines = lines;
    this.redraw();
  }

  protected paint(context: CanvasRenderingContext2D): void {
    const height = this.lines.length * LINE + 12;
    box(context, { x: 0, y: 0, w: WIDTH, h: height }, 12, "rgba(16, 23, 33, 0.72)");
    this.lines.forEach(({ left, right }, index) => {
      const y = 6 + index * LINE;
      const dot = index === 0 ? 20 : 0;
      if (dot > 0) box(context, { x: MARGIN, y: y + LINE / 2 - 6, w: 12, h: 12 }, 6, COLOUR[left.tone]);
      context.font = `600 ${EM}px system-ui`;
      const rightWidth = right === null ? 0 : Math.min(170, context.measureText(right.text).width * 1.06 + 10);
      const room = WIDTH - 2 * MARGIN - dot;
      write(context, left.text, { x: MARGIN + dot, y, w: room - rightWidth - 6, h: LINE }, EM, COLOUR[left.tone], "left", 600);
      if (right !== null) {
        write(context, right.text, { x: WIDTH - MARGIN - rightWidth, y, w: rightWidth, h: LINE }, EM, COLOUR[right.tone], "right", 500);
      }
    });
  }
}

/** What nobody must miss: large, in the middle of the view, before everything. */
export class Notice extends CanvasPlate {
  readonly follower = new LazyFollower(1, (6 * Math.PI) / 180);
  private words: NoticeWords | null = null;

  constructor() {
    super("notice", 620, 190, 1.4, PLATE_ORDER + 10);
    this.before();
  }

  get text(): string {
    return this.words === null ? "" : `${this.words.title}. ${this.words.detail} ${this.words.hint}`;
  }

  say(words: NoticeWords | null): void {
    if (words === this.words || JSON.stringify(words) === JSON.stringify(this.words)) return;
    if (this.words === null) this.follower.jump();
    this.words = words;
    this.group.visible = words !== null;
    if (words !== null) this.redraw();
  }

  protected paint(context: CanvasRenderingContext2D): void {
    if (this.words === null) return;
    box(context, { x: 0, y: 0, w: this.widthMm, h: this.heightMm }, 18, "rgba(56, 14, 18, 0.95)");
    context.strokeStyle = INK.bad;
    context.lineWidth = 4;
    context.stroke();
    const row = (y: number, h: number): { x: number; y: number; w: number; h: number } => ({ x: 26, y, w: this.widthMm - 52, h });
    write(context, this.words.title, row(18, 62), 46, INK.text, "center", 700);
    write(context, this.words.detail, row(84, 44), 31, INK.text, "center");
    write(context, this.words.hint, row(130, 44), 31, INK.soft, "center");
  }
}
