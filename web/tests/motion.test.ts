import { describe, expect, it, vi } from "vitest";
import type { TrackMessage } from "../src/generated/messages";
import type { DrawnTrack } from "../src/motion/drawn";
import { Interpolator, STALE_S } from "../src/motion/interpolator";
import { MOST_DELAY_S } from "../src/motion/timeline";
import type { Course, Motion } from "./course";
import { DISPLAY_S, distance, HOST, K, play, pushed, still, track } from "./course";

vi.setConfig({ testTimeout: 120_000 }); // a limit on hanging, on a machine that does other things too

/** 30 mm to and fro at 1 Hz: up to 94 mm/s. */
const swaying: Motion = (t) => ({ tip: [60 + 15 * Math.sin(2 * Math.PI * t), 8 * Math.cos(Math.PI * t), -8], roll: 2 * t });

describe("the delay", () => {
  it.each([
    ["60 Hz, no jitter", 60, () => 0.02, 1 / 60 + 0.012],
    ["60 Hz, 10 ms of jitter", 60, (random: () => number) => 0.02 + 0.01 * random(), 1 / 60 + 0.012 + 0.01],
    ["30 Hz, no jitter", 30, () => 0.03, 1 / 30 + 0.012],
  ])("is one interval and the jitter: %s", (_, rateHz, journey, most) => {
    const course: Course = { rateHz, seconds: 12, motion: swaying, journey };
    const shown = play(course, 1, 6);
    const quickest = journey(() => 0);
    for (const { nowS, t } of shown) {
      expect(nowS - quickest - t).toBeLessThanOrEqual(most);
      expect(nowS - quickest - t).toBeGreaterThanOrEqual(0);
    }
  });

  it("is 60 ms at most: what comes later than that is bridged by a guess", () => {
    const motion = new Interpolator();
    const shown = play({ rateHz: 60, seconds: 12, motion: swaying, journey: (random) => 0.02 + 0.08 * random() }, 1, 6, motion);
    expect(motion.waitMs).toBeCloseTo(1000 * MOST_DELAY_S, 6);
    // A Track that is 80 ms late is waited for and the guess lasts one interval: the drawing stands still in between.
    for (const { nowS, t } of shown) expect(nowS - 0.02 - t).toBeLessThan(0.08 + 0.012);
  });

  it("is enough for nearly all frames to lie between two Tracks", () => {
    for (let seed = 1; seed <= 10; seed++) {
      const shown = play({ rateHz: 60, seconds: 14, motion: swaying, journey: (random) => 0.02 + 0.02 * random() ** 2 }, seed, 6);
      expect(shown.filter((each) => each.extrapolated).length / shown.length).toBeLessThan(0.05);
    }
  });

  it("is told in terms of the world's time, and not at all for a replay", () => {
    const motion = new Interpolator();
    for (let i = 0; i < 60; i++) motion.put(track(i, HOST + i / 60, still(0)), i / 60 + 0.02);
    const drawn = motion.sample(1.01, HOST)!;
    expect(drawn.delayMs).toBeCloseTo(1000 * (1.01 + HOST - drawn.t), 6);
    expect(motion.sample(1.011, null)!.delayMs).toBeNull();
    motion.put(track(60, HOST + 1, still(0), { latency_ms: null }), 1.02);
    expect(motion.sample(1.02, HOST)!.delayMs).toBeNull();
  });
});

describe("what is drawn", () => {
  it("is the true motion at the instant that it says, whatever the link does", () => {
    for (let seed = 1; seed <= 8; seed++) {
      const shown = play({
        rateHz: 60, seconds: 8, motion: swaying, loss: 0.1, overtake: seed % 2 === 0,
        journey: (random) => 0.015 + 0.03 * random() ** 3,
      }, seed, 2);
      for (const each of shown) {
        // With three losses in a row (1/15 s between two Tracks) a guess 1/30 s beyond them, at 15 mm (2 pi)^2 = 592 mm/s^2,
        // is off by 592 / 2 / 30 (1/30 + 1/15) = 1 mm, and is taken back within 40 ms; the filter's leash adds 0.25 mm.
        expect(distance(each.tip, swaying(each.t).tip)).toBeLessThan(1.6);
      }
    }
  });

  it("goes on in time without a step, also when Tracks come late", () => {
    for (let seed = 1; seed <= 8; seed++) {
      const shown = play({ rateHz: 60, seconds: 8, motion: swaying, loss: 0.05, journey: (random) => 0.015 + 0.05 * random() ** 4 }, seed, 2);
      for (let i = 1; i < shown.length; i++) {
        expect(shown[i]!.t).toBeGreaterThanOrEqual(shown[i - 1]!.t - 1e-9);
        expect(distance(shown[i]!.tip, shown[i - 1]!.tip)).toBeLessThan(2.2 * 98 * DISPLAY_S); // twice the top speed
      }
    }
  });

  it("does not show a wrong guess any more where pictures are few", () => {
    const motion = new Interpolator();
    const turning: Motion = (t) => ({ tip: [60 + 20 * Math.abs(t - 1), 5, -8], roll: 0 }); // 20 mm/s, the other way from t = 1 on
    for (let i = 0; i <= 60; i++) motion.put(track(i, HOST + i / 60, turning(i / 60)), i / 60 + 0.02);
    motion.sample(1.02, HOST);
    expect(motion.sample(1.09, HOST)!.extrapolated).toBe(true); // carried on the old way
    for (let i = 61; i <= 78; i++) motion.put(track(i, HOST + i / 60, turning(i / 60)), i / 60 + 0.02);
    const drawn = motion.sample(1.3, HOST)!; // the next picture, 0.2 s later
    expect(drawn.extrapolated).toBe(false);
    expect(distance(drawn.tip, turning(drawn.t - HOST).tip)).toBeLessThan(0.1); // it was shown to go on for 5 mm
  });

  it("goes beyond the newest Track by at most one interval, and says so", () => {
    const motion = new Interpolator();
    for (let i = 0; i < 120; i++) motion.put(track(i, HOST + i / 60, pushed(60)(i / 60)), i / 60 + 0.02);
    const newest = HOST + 119 / 60;
    const ends: number[] = [];
    for (let nowS = 2; nowS < 3; nowS += DISPLAY_S) {
      const drawn = motion.sample(nowS, HOST)!;
      expect(drawn.t).toBeLessThanOrEqual(newest + 1 / 60 + 1e-9);
      expect(drawn.extrapolated).toBe(drawn.t > newest);
      ends.push(drawn.tip[0]!);
    }
    expect(ends.at(-1)! - (20 + 60 * (120 / 60))).toBeLessThan(0.2);
  });

  it("turns the way it was turned, also by more than half a turn from Track to Track", () => {
    const motion = new Interpolator();
    for (let i = 0; i < 30; i++) motion.put(track(i, HOST + i / 20, { tip: [60, 0, 0], roll: 4 * i }), i / 20);
    for (let nowS = 1; nowS < 1.4; nowS += DISPLAY_S) {
      const drawn = motion.sample(nowS, HOST)!;
      const [w, x, y, z] = drawn.orientation as unknown as [number, number, number, number];
      expect(Math.hypot(w, x, y, z)).toBeCloseTo(1, 9);
      expect(Math.cos(2 * Math.atan2(z, w) - drawn.roll!)).toBeCloseTo(1, 6);
      expect(drawn.roll!).toBeCloseTo(80 * (drawn.t - HOST), 1);
    }
  });

  it("has no roll between a Track with and one without", () => {
    const motion = new Interpolator();
    for (let i = 0; i < 12; i++) motion.put(track(i, HOST + i / 60, { tip: [60, 0, 0], roll: i < 10 ? 1 : null }), i / 60);
    const rolls = [];
    for (let nowS = 0.1; nowS < 0.25; nowS += 0.004) rolls.push(motion.sample(nowS, HOST)!.roll);
    expect(rolls[0]).toBeCloseTo(1, 6);
    expect(rolls.at(-1)).toBeNull();
  });
});

describe("interruptions", () => {
  const fed = (motion: Interpolator, from: number, to: number, t0 = HOST, at0 = 0, more: Partial<TrackMessage> = {}): void => {
    for (let i = from; i < to; i++) motion.put(track(i, t0 + i / 60, swaying(i / 60), more), at0 + i / 60 + 0.02);
  };

  it("hides a lost catheter when its instant comes, and shows it again when it is found", () => {
    const motion = new Interpolator();
    fed(motion, 0, 60);
    fed(motion, 60, 90, HOST, 0, { status: "lost", reason: "no catheter", points: null, tip: null, roll: null });
    fed(motion, 90, 120);
    const status = (nowS: number): string => motion.sample(nowS, HOST)!.status;
    const probe = new Interpolator();
    fed(probe, 0, 60);
    expect(probe.sample(1.0, HOST)!.status).toBe("tracked");
    expect(motion.sample(2.02, HOST)!.status).toBe("tracked");
    const during = new Interpolator();
    fed(during, 0, 60);
    fed(during, 60, 80, HOST, 0, { status: "lost", reason: "no catheter", points: null, tip: null, roll: null });
    const drawn = during.sample(1.33, HOST)!;
    expect([drawn.status, drawn.reason, drawn.roll]).toEqual(["lost", "no catheter", null]);
    expect(status(2.03)).toBe("tracked");
  });

  it("shows coasting as such, in motion", () => {
    const motion = new Interpolator();
    fed(motion, 0, 60);
    fed(motion, 60, 90, HOST, 0, { status: "coasting", reason: "no picture from top" });
    const drawn = motion.sample(1.48, HOST)!;
    expect([drawn.status, drawn.reason]).toEqual(["coasting", "no picture from top"]);
    expect(distance(drawn.tip, swaying(drawn.t - HOST).tip)).toBeLessThan(0.3);
  });

  it("marks as stale what nothing follows, and goes on when something does", () => {
    const motion = new Interpolator();
    fed(motion, 0, 60);
    expect(motion.sample(1.1, HOST)!.stale).toBe(false);
    const stale = motion.sample(1.1 + STALE_S, HOST)!;
    expect([stale.stale, stale.status, stale.delayMs]).toEqual([true, "tracked", null]);
    fed(motion, 180, 200); // three seconds later: the same clock
    const drawn = motion.sample(200 / 60 + 0.02, HOST)!;
    expect(drawn.stale).toBe(false);
    expect(distance(drawn.tip, swaying(drawn.t - HOST).tip)).toBeLessThan(0.3);
  });

  it.each([["back", -30], ["back a little", -0.4], ["ahead", 40]])("follows a replay's seek %s at once", (_, by) => {
    const motion = new Interpolator();
    fed(motion, 0, 120, HOST, 0, { latency_ms: null });
    motion.sample(2.01, HOST);
    fed(motion, 120, 150, HOST + by, 0, { latency_ms: null });
    const drawn = motion.sample(150 / 60 + 0.02, HOST)!;
    expect(Math.abs(drawn.t - (HOST + by + 149 / 60))).toBeLessThan(0.1);
  });

  it("holds a paused replay still and goes on after it", () => {
    const motion = new Interpolator();
    fed(motion, 0, 120, HOST, 0, { latency_ms: null });
    const tip = [...motion.sample(3, HOST)!.tip];
    expect([...motion.sample(4.2, HOST)!.tip]).toEqual(tip);
    for (let i = 120; i < 150; i++) motion.put(track(i, HOST + i / 60, swaying(i / 60), { latency_ms: null }), i / 60 + 10.02);
    const drawn = motion.sample(150 / 60 + 10.02, HOST)!;
    expect(Math.abs(drawn.t - (HOST + 149 / 60))).toBeLessThan(0.1);
  });

  it("takes another number of points in its stride", () => {
    const motion = new Interpolator();
    fed(motion, 0, 30);
    const other = track(30, HOST + 0.5, swaying(0.5));
    other.points = Array.from({ length: 30 }, (_, i) => other.points![Math.min(K - 1, Math.round((i * (K - 1)) / 29))]!);
    motion.put(other, 0.52);
    const counts = [0.5, 0.51, 0.52, 0.53, 0.56].map((nowS): [number, boolean] => {
      const drawn: DrawnTrack = motion.sample(nowS, HOST)!;
      return [drawn.count, drawn.points.every(Number.isFinite)];
    });
    expect(counts.at(-1)).toEqual([30, true]);
  });

  it("knows nothing before the first Track and after being told to forget", () => {
    const motion = new Interpolator();
    expect(motion.sample(1, HOST)).toBeNull();
    fed(motion, 0, 10);
    motion.clear();
    expect(motion.sample(2, HOST)).toBeNull();
  });
});
