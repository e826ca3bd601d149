import { describe, expect, it, vi } from "vitest";
import { Interpolator } from "../src/motion/interpolator";
import { NoiseLevel } from "../src/motion/noise_level";
import type { Course, Motion, Shown } from "./course";
import { distance, HOST, normalFrom, play, pushed, still, track } from "./course";
import { makeRandom } from "./random";

vi.setConfig({ testTimeout: 120_000 }); // a limit on hanging, on a machine that does other things too

/** What the twin's Tracks scatter by at rest, per axis, and what they tell as sigma_mm (rest_filter.ts has the table). */
const TWIN = { noiseMm: 0.004, noiseRad: 0.0021, sigmaMm: 0.045 } as const;
const RATES = [10, 30, 60] as const;
const quiet = { seconds: 25, journey: (random: () => number) => 0.02 + 0.006 * random() } as const;

/** Root mean square of the distance from the mean place, all axes, mm. */
function shimmer(shown: readonly Shown[]): number {
  const mean = [0, 1, 2].map((axis) => shown.reduce((sum, { tip }) => sum + tip[axis]!, 0) / shown.length);
  return Math.sqrt(shown.reduce((sum, { tip }) => sum + distance(tip, mean) ** 2, 0) / shown.length);
}

/** How late a motion along x is drawn, beyond the instant that the drawing says it shows, ms. */
function lagMs(speed: number, course: Omit<Course, "motion" | "seconds">, seed: number): number {
  const motion = pushed(speed);
  const shown = play({ ...course, seconds: 6, motion }, seed, 2);
  return (1000 * shown.reduce((sum, { t, tip }) => sum + motion(t).tip[0] - tip[0], 0)) / shown.length / speed;
}

describe("at rest", () => {
  it.each(RATES)("the twin's noise is drawn within 0.02 mm, at %d Hz", (rateHz) => {
    for (let seed = 1; seed <= 3; seed++) {
      const shown = play({ ...quiet, ...TWIN, rateHz, motion: still }, seed, 5);
      const share = Math.sqrt(1 - Math.exp((-2 * Math.PI * 0.6) / rateHz)); // of the noise, about: see rest_filter.ts
      expect(shimmer(shown)).toBeLessThan(share * TWIN.noiseMm * Math.sqrt(3)); // 0.001 to 0.004 mm
      expect(shimmer(shown)).toBeLessThan(0.02);
    }
  });

  it.each([30, 60])("so is noise of 15 times the twin's, at %d Hz, on each axis", (rateHz) => {
    for (let seed = 1; seed <= 3; seed++) {
      const shown = play({ ...quiet, rateHz, motion: still, noiseMm: 0.06, sigmaMm: 0.12 }, seed, 8);
      expect(shimmer(shown) / Math.sqrt(3)).toBeLessThan(0.02);
    }
  });

  it.each(RATES)("the direction is drawn within 1 mrad, that is 0.09 mm at the far end of a beam of 90 mm, at %d Hz", (rateHz) => {
    for (let seed = 1; seed <= 3; seed++) {
      const bends = play({ ...quiet, ...TWIN, rateHz, motion: still }, seed, 5).map(({ bend }) => bend);
      expect(Math.sqrt(bends.reduce((sum, bend) => sum + bend ** 2, 0) / bends.length)).toBeLessThan(0.001);
    }
  });

  it("Tracks that are late, lost, double or out of their order make no difference to speak of", () => {
    for (const more of [{ loss: 0.2 }, { twice: 0.3 }, { overtake: true, journey: (random: () => number) => 0.02 + 0.05 * random() }]) {
      const shown = play({ ...quiet, ...TWIN, rateHz: 30, motion: still, ...more }, 4, 5);
      expect(shimmer(shown)).toBeLessThan(0.004);
    }
  });

  it("a clock that jumps is followed, and does not move the catheter", () => {
    for (const jump of [3600, -3600, 0.4, -0.4]) {
      const motion = new Interpolator();
      const normal = normalFrom(makeRandom(9));
      let last: readonly number[] = still(0).tip;
      for (let frame = 0; frame < 900; frame++) {
        const s = frame / 90;
        if (frame % 3 === 0) {
          const { tip, roll } = still(s);
          const noisy = tip.map((value) => value + TWIN.noiseMm * normal()) as [number, number, number];
          motion.put(track(frame, HOST + s + (s < 5 ? 0 : jump), { tip: noisy, roll }, { sigma_mm: TWIN.sigmaMm }), s);
        }
        const drawn = motion.sample(s, HOST)!;
        expect(drawn.status).toBe("tracked");
        expect(distance(drawn.tip, last)).toBeLessThan(0.03); // the noise of one measurement where it begins anew
        last = [...drawn.tip];
        if (s > 5.5) expect(Math.abs(drawn.t - (HOST + s + jump))).toBeLessThan(0.15);
      }
    }
  });
});

describe("in motion", () => {
  it.each(RATES.flatMap((rateHz) => [2, 6].map((speed) => [rateHz, speed] as const)))(
    "the twin's catheter at %d Hz lags by less than 20 ms at %d mm/s",
    (rateHz, speed) => {
      for (let seed = 1; seed <= 3; seed++) expect(lagMs(speed, { ...quiet, ...TWIN, rateHz }, seed)).toBeLessThan(20);
    },
  );

  it.each(RATES.flatMap((rateHz) => [50, 150].map((speed) => [rateHz, speed] as const)))(
    "and at %d Hz not at all at %d mm/s",
    (rateHz, speed) => {
      // "Not at all": less than half a millisecond, 4 s / v or less.
      for (let seed = 1; seed <= 3; seed++) expect(Math.abs(lagMs(speed, { ...quiet, ...TWIN, rateHz }, seed))).toBeLessThan(0.5);
    },
  );

  it("noise of 15 times the twin's costs less than 20 ms from 10 mm/s on", () => {
    for (const speed of [10, 20, 60]) expect(lagMs(speed, { ...quiet, rateHz: 60, noiseMm: 0.06, sigmaMm: 0.12 }, 1)).toBeLessThan(20);
  });

  it("a motion that begins slowly is seen at once: what is drawn is never off by more than the leash", () => {
    const begun: Motion = (t) => ({ tip: [60 + (t < 8 ? 0 : 2 * (t - 8)), 5, -8], roll: null });
    for (const rateHz of RATES) {
      for (const { t, tip } of play({ ...quiet, ...TWIN, rateHz, seconds: 12, motion: begun }, 1, 6)) {
        // 4 s, of a level that is known to a half; the noise of a measurement (4 s); the corner itself, cut by the chord.
        expect(distance(tip, begun(t).tip)).toBeLessThan(TWIN.noiseMm * (4 * 1.5 + 4) + 0.26 * (2 / rateHz));
      }
    }
  });

  it.each(RATES)("a turn of the tip is followed within half a degree, at %d Hz", (rateHz) => {
    // Flexed at 10 degrees a second about a bend 30 mm behind the tip.
    const rate = Math.PI / 18;
    const flexed: Motion = (t) => ({ tip: [60 + 30 * Math.sin(rate * t), 5, -8 - 30 * (1 - Math.cos(rate * t))], roll: 0.3, bend: rate * t });
    const shown = play({ ...quiet, ...TWIN, rateHz, seconds: 8, motion: flexed }, 2, 2);
    for (const { t, bend } of shown) expect((Math.abs(bend - rate * t) * 180) / Math.PI).toBeLessThan(0.5);
    expect(Math.abs(shown.reduce((sum, { t, bend }) => sum + rate * t - bend, 0) / shown.length / rate)).toBeLessThan(0.02);
  });

  it("the body of the catheter is followed where it moves and the tip does not", () => {
    const motion = new Interpolator();
    let worst = 0;
    for (let i = 0; i < 120; i++) {
      const t = i / 30;
      const sent = track(i, HOST + t, { tip: [60, 5, -8], roll: 0.3 }, { sigma_mm: TWIN.sigmaMm });
      for (const [j, point] of sent.points!.entries()) (point as [number, number, number])[1] += 5 * Math.sin(t) * Math.sin((Math.PI * j) / (sent.points!.length - 1));
      motion.put(sent, t + 0.02);
      const drawn = motion.sample(t + 0.02, HOST)!;
      const middle = Math.round(0.5 * (drawn.count - 1));
      const truth = 5 * (1 - middle / (drawn.count - 1)) ** 2 + 5 * Math.sin(drawn.t - HOST) * Math.sin((Math.PI * middle) / (drawn.count - 1));
      if (i > 30) worst = Math.max(worst, Math.abs(drawn.points[3 * middle + 1]! - truth));
    }
    expect(worst).toBeLessThan(0.05);
  });
});

describe("a sudden stop", () => {
  const stopped = (speed: number): Motion => (t) => ({ tip: [20 + speed * Math.min(t - 4, 0), 5, -8], roll: null });
  const overshoot = (shown: readonly Shown[]): number => Math.max(...shown.filter(({ t }) => t > 4).map(({ tip }) => tip[0] - 20));

  it.each(RATES.flatMap((rateHz) => [50, 150].map((speed) => [rateHz, speed] as const)))(
    "at %d Hz from %d mm/s is not overshot by 0.3 mm, however the Tracks come within the wait",
    (rateHz, speed) => {
      for (let seed = 1; seed <= 10; seed++) {
        const course = { ...TWIN, rateHz, seconds: 6, motion: stopped(speed), journey: (random: () => number) => 0.02 + 0.012 * random() };
        expect(overshoot(play(course, seed, 1))).toBeLessThan(0.3);
        expect(overshoot(play({ ...course, twice: 0.3 }, seed, 1))).toBeLessThan(0.3);
      }
    },
  );

  it("is overshot by no more than one interval's way where just then a Track is lost, and taken back", () => {
    const shown = play({ ...TWIN, rateHz: 30, seconds: 6, motion: stopped(150), journey: () => 0.02, loss: 0.15 }, 3, 1);
    expect(overshoot(shown)).toBeLessThan(150 / 30);
    expect(Math.abs(overshoot(shown.filter(({ t }) => t > 4.4)))).toBeLessThan(0.05);
  });
});

describe("NoiseLevel", () => {
  it.each([[3, 0.004], [3, 0.06], [2, 0.0021]] as const)("finds the noise in %d dimensions of %d, also with intervals missing", (dimensions, level) => {
    const random = makeRandom(5);
    const normal = normalFrom(random);
    const noise = new NoiseLevel(dimensions, 1e-4, 0.01);
    const raw: { t: number; at: number[] }[] = [];
    const seen: number[] = [];
    for (let i = 0; i < 3000; i++) {
      if (random() < 0.2) continue;
      raw.push({ t: i / 30, at: Array.from({ length: dimensions }, () => 0.2 * i + level * normal()) }); // in even motion
      if (raw.length < 3) continue;
      const [a, b, c] = raw.slice(-3) as [typeof raw[0], typeof raw[0], typeof raw[0]];
      const ratio = (c.t - b.t) / (b.t - a.t);
      noise.step(c.at.reduce((sum, value, axis) => sum + (value - b.at[axis]! - ratio * (b.at[axis]! - a.at[axis]!)) ** 2, 0), ratio, 1);
      if (i > 300) seen.push(noise.value / level);
    }
    expect(seen.reduce((sum, value) => sum + value, 0) / seen.length).toBeGreaterThan(0.8);
    expect(seen.reduce((sum, value) => sum + value, 0) / seen.length).toBeLessThan(1.25);
    expect(Math.max(...seen)).toBeLessThan(2);
  });
});
