import { describe, expect, it } from "vitest";
import type { HealthMessage, TrackMessage } from "../src/generated/messages";
import { degrees, duration, fixed, NO_VALUE, sentence, withUnits } from "../src/maths/format";
import { nth, RateMeter, Recent } from "../src/maths/statistics";
import { makeRandom } from "./random";
import { settingsFrom } from "../src/settings";
import { TrackLog } from "../src/link/tracks";
import type { Situation } from "../src/ui/condition";
import { condition, hintFor } from "../src/ui/condition";

describe("format", () => {
  it("writes numbers, with a true minus and a dash for nothing", () => {
    expect(fixed(-12.345, 1)).toBe("−12.3");
    expect(fixed(-0.04, 1)).toBe("0.0");
    expect(fixed(null, 1)).toBe(NO_VALUE);
    expect(fixed(Number.NaN, 1)).toBe(NO_VALUE);
    expect(degrees(Math.PI)).toBe("180.0");
    expect(degrees(null)).toBe(NO_VALUE);
    expect(duration(65)).toBe("1:05");
    expect(duration(3725.9)).toBe("1:02:05");
    expect(sentence("no catheter")).toBe("No catheter.");
    expect(sentence("")).toBe("");
    expect(withUnits("to 0.4 % and 3 mm in 2 steps")).toBe("to 0.4\u00a0% and 3\u00a0mm in 2 steps");
  });
});

describe("statistics", () => {
  it("finds any rank among the first numbers, equal ones included, and leaves the others alone", () => {
    const random = makeRandom(3);
    for (let round = 0; round < 200; round++) {
      const count = 1 + Math.floor(30 * random());
      const numbers = Float64Array.from({ length: 32 }, () => Math.floor(12 * random()));
      const sorted = [...numbers.subarray(0, count)].sort((a, b) => a - b);
      const rest = [...numbers.subarray(count)];
      const rank = Math.floor(count * random());
      expect(nth(numbers, count, rank)).toBe(sorted[rank]);
      expect([...numbers.subarray(0, count)].sort((a, b) => a - b)).toEqual(sorted);
      expect([...numbers.subarray(count)]).toEqual(rest);
    }
  });

  it("measures a rate, and 0 when it stops", () => {
    const meter = new RateMeter(2);
    for (let i = 0; i < 400; i++) meter.mark(i / 60);
    expect(meter.rate(399 / 60)).toBeCloseTo(60, 6);
    expect(meter.rate(399 / 60 + 3)).toBe(0);
  });

  it("gives percentiles of the last values", () => {
    const recent = new Recent(4);
    expect(recent.percentile(0.5)).toBeNull();
    recent.add(9);
    expect(recent.percentile(0.5)).toBe(9);
    for (const value of [5, 1, 3, 2]) recent.add(value);
    expect(recent.percentile(0)).toBe(1);
    expect(recent.percentile(1)).toBe(5);
  });
});

describe("TrackLog", () => {
  it("finds a Track by its pair and never another's", () => {
    const log = new TrackLog();
    for (let seq = 0; seq < 300; seq++) log.put({ ...TRACK, seq });
    expect(log.get(299)?.seq).toBe(299);
    expect(log.get(43)).toBeNull();
    expect(log.get(555)).toBeNull();
    expect(log.newest?.seq).toBe(299);
  });
});

describe("settings", () => {
  it("reads the quality switches and keeps out nonsense", () => {
    expect(settingsFrom("?aa=0&mat=lambert&dpr=1&pictures=0")).toEqual({
      antialias: false, material: "lambert", pixelRatio: 1, picturesHz: 0, heart: true,
    });
    expect(settingsFrom("?dpr=nonsense&pictures=1e9")).toMatchObject({ pixelRatio: null, picturesHz: 120, antialias: true });
  });
});

const TRACK: TrackMessage = {
  type: "track", seq: 1, t: 1, status: "tracked", reason: "", points: null, tip: null,
  roll: null, roll_predicted: false, yaw: null, pitch: null, sigma_mm: null, latency_ms: 20,
};
const FINE: Situation = {
  link: { phase: "live", sentence: "", retryAtMs: null }, track: TRACK, trackAgeMs: 20, health: null, nowMs: 1000,
};

describe("condition", () => {
  it("says nothing while all is well", () => {
    expect(condition(FINE)).toEqual({ label: "tracked", level: "good", banner: null, stale: false });
  });

  it("says that the link is lost and when it is tried again, before anything else", () => {
    const now = condition({
      ...FINE, track: { ...TRACK, status: "lost", reason: "black picture" },
      link: { phase: "lost", sentence: "The server was stopped", retryAtMs: 3500 },
    });
    expect(now.banner?.title).toContain("link");
    expect(now.banner?.detail).toBe("The server was stopped.");
    expect(now.banner?.hint).toContain("3 s");
    expect(now.stale).toBe(true);
    expect(now.banner?.retry).toBe(true);
  });

  it("names the reason of a loss and what to do about it", () => {
    const now = condition({ ...FINE, track: { ...TRACK, status: "lost", reason: "black picture from top" } });
    expect(now.banner?.detail).toBe("Black picture from top.");
    expect(now.banner?.hint).toContain("back-light");
    expect(hintFor("something new").length).toBeGreaterThan(10);
  });

  it("notices that pictures stop, and names the source that fails", () => {
    const health: HealthMessage = {
      type: "health", t: 0, skew_ms: null, clients: 1, skipped: 0,
      sources: [{ source: "top", running: false, age_s: 4, rate_hz: 0, losses: 0, last_error: "the camera was unplugged" }],
    };
    const now = condition({ ...FINE, trackAgeMs: 4000, health });
    expect(now.banner?.title).toBe("No new pictures");
    expect(now.banner?.detail).toBe("Top: the camera was unplugged.");
    expect(condition({ ...FINE, track: null, trackAgeMs: 2000 }).banner).toBeNull();
    expect(condition({ ...FINE, track: null, trackAgeMs: 9000 }).banner?.title).toBe("No pictures yet");
  });
});
