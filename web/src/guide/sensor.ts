/** Reads from the scene what the guide measures, and in what situation somebody is. */

import { Spherical, Vector3 } from "three";
import type { SceneDescription } from "../generated/messages";
import type { Frame } from "../stage/feature";
import { CONTROLS } from "../stage/controls";
import type { SettingsStore } from "../stage/settings";
import type { Stage } from "../stage/stage";
import type { Immersion } from "../xr/immersion";
import type { Bend } from "./bend";
import { measureBend } from "./bend";
import type { Measured, Mover, Place, Situation } from "./situation";
import { still } from "./situation";

const DEG = 180 / Math.PI;

/** Steering of the twin by this person. */
export interface Steers {
  /** Whether this page may steer. */
  readonly able: boolean;
  /** Whether it has been steered here since a script ran. */
  readonly byHand: boolean;
  nudge(control: "insertion_mm" | "roll_deg" | "anterior_deg" | "left_deg", amount: number): void;
}

export class Sensor {
  readonly now: Measured = still();
  private readonly bend: Bend = { lengthMm: 0, bendDeg: 0, towardsDeg: 0 };
  private readonly offset = new Vector3();
  private readonly spherical = new Spherical();
  private readonly touch = matchMedia("(pointer: coarse)");
  private source = "";
  private heart = false;
  /** Whether there is an encoder, as the server says; it may not know the roll yet. */
  encoder = false;
  private rolled = false;
  private changes = 0;
  private lock: SettingsStore["lock"] = null;
  private borrowed = false;
  /** Set while the guide itself changes settings: that is no doing of the person's. */
  private quiet = false;

  constructor(private readonly stage: Stage, private readonly immersion: Immersion, private readonly steers: Steers) {
    const { store } = stage;
    store.listen((now, before) => {
      // What is borrowed or locked is changed by somebody else.
      const others = store.lock !== this.lock || store.borrowed || this.borrowed;
      this.lock = store.lock;
      this.borrowed = store.borrowed;
      if (now !== before && !others && !this.quiet) this.changes += 1;
    });
  }

  describe(scene: SceneDescription): void {
    this.source = scene.source;
    this.heart = scene.heart !== null && this.stage.settings.heart;
    this.rolled = false;
  }

  /** Whether a scene has been described. */
  get ready(): boolean {
    return this.source !== "";
  }

  /** Changes settings for the guide's own purpose. */
  quietly(act: () => void): void {
    this.quiet = true;
    act();
    this.quiet = false;
  }

  situation(immersive: boolean): Situation {
    const { store, view } = this.stage;
    return {
      place: this.place(immersive),
      mover: this.mover(),
      roll: this.rolled || this.encoder,
      heart: this.heart,
      space: store.value.mode === "3d",
      free: immersive || view.controls.enabled,
      settings: CONTROLS.some(({ key, shown }) => !store.locked(key) && (shown?.(store.value) ?? true)),
      ice: !store.locked("ice"),
      targets: !store.locked("targets"),
    };
  }

  /** Brings `now` up to date. */
  update(frame: Frame): void {
    const { now, stage } = this;
    now.nowMs = frame.nowMs;
    now.dtS = frame.dtS;
    this.readCatheter(frame);
    now.steered = this.mover() === "hand" || this.steers.byHand;
    now.menuOpen = this.immersion.menu.visible;
    now.changes = this.changes;
    now.ice = stage.store.value.ice;
    const { target } = stage.readout;
    now.targetMm = target?.distanceMm ?? null;
    now.targetReached = target?.reached ?? false;
    now.targetWithin = target?.within ?? false;
    if (frame.immersive) this.readHands();
    else this.readCamera();
  }

  private place(immersive: boolean): Place {
    if (!immersive) return this.touch.matches ? "touch" : "mouse";
    return this.immersion.pointers.some((pointer) => pointer.tracked && pointer.bare) ? "hands" : "controllers";
  }

  private mover(): Mover {
    if (this.source === "twin") return this.steers.able ? "twin" : "nobody";
    return this.source === "replay" || this.source === "" ? "nobody" : "hand";
  }

  private readCatheter({ track }: Frame): void {
    const { now, bend } = this;
    now.known = track !== null && track.status === "tracked" && !track.stale && track.count >= 2;
    if (!now.known) return;
    measureBend(bend, track!.points, track!.count);
    now.insertedMm = bend.lengthMm;
    now.bendDeg = bend.bendDeg;
    now.bendTowardsDeg = bend.towardsDeg;
    now.rollDeg = track!.roll === null ? null : track!.roll * DEG;
    if (track!.roll !== null) this.rolled = true;
  }

  private readCamera(): void {
    const { now, stage, offset, spherical } = this;
    const { camera, controls } = stage.view;
    spherical.setFromVector3(offset.subVectors(camera.position, controls.target));
    const azimuth = spherical.theta * DEG;
    now.azimuthDeg += azimuth - now.azimuthDeg - 360 * Math.round((azimuth - now.azimuthDeg) / 360);
    now.heightDeg = spherical.phi * DEG;
    now.size = 1 / Math.max(1e-6, spherical.radius);
    now.handMoved = stage.presets.current === null && controls.enabled;
  }

  private readHands(): void {
    const { now, immersion, offset } = this;
    const { grab, centre } = immersion.places;
    grab.world.apply(offset.copy(centre));
    now.heartCm[0] = 100 * offset.x;
    now.heartCm[1] = 100 * offset.y;
    now.heartCm[2] = 100 * offset.z;
    now.size = grab.world.scale;
    now.handMoved = grab.hands > 0;
  }
}
