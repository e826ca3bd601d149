import { describe, expect, it } from "vitest";
import type { DiagReport } from "../src/generated/messages";
import { HeadsetLog, lastHeadsetFrames } from "../src/diag/headset_log";
import { SpreadMeter } from "../src/diag/spread";
import { cardsOf, verdict } from "../src/diag/words";
import { cableStep, stepsFor } from "../src/ui/headset";
import { valueText } from "../src/ui/controls";

describe("a spread", () => {
  it("has the quantiles of what was put in, to its step", () => {
    const meter = new SpreadMeter();
    expect(meter.spread()).toBeNull();
    for (let i = 1; i <= 1000; i++) meter.add(i / 50); // 0.02 to 20 ms, evenly
    meter.add(NaN);
    meter.add(-1);
    const spread = meter.spread()!;
    expect(spread.count).toBe(1000);
    expect(spread.median).toBeCloseTo(10, 0);
    expect(Math.abs(spread.p95 - 19)).toBeLessThan(0.06);
    expect(Math.abs(spread.p99 - 19.8)).toBeLessThan(0.06);
    expect(spread.longest).toBe(20);
    expect(Math.abs(spread.over - 250)).toBeLessThanOrEqual(6); // over 15 ms: a quarter, and a bin at the limit
  });

  it("takes times beyond its last bin", () => {
    const meter = new SpreadMeter();
    for (const ms of [10, 10, 10, 4000]) meter.add(ms);
    expect(meter.spread()).toMatchObject({ longest: 4000, p99: 4000, over: 1 });
  });
});

function storage(): Storage {
  const kept = new Map<string, string>();
  return { getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, text: string) => void kept.set(key, text) } as unknown as Storage;
}

describe("the log of a headset's frames", () => {
  it("keeps a session's figures for /diag", () => {
    const store = storage();
    const log = new HeadsetLog(store, { scriptMs: () => 1.5, rateHz: () => 90 });
    expect(lastHeadsetFrames(store)).toBeNull();
    log.recordFrame(0); // no session: not counted
    log.begin("vr");
    for (let i = 0; i < 300; i++) log.recordFrame(i * 11.1 + (i === 200 ? 5 : 0));
    log.end();
    const found = lastHeadsetFrames(store)!;
    expect(found).toMatchObject({ mode: "vr", rate_hz: 90 });
    expect(Math.abs(found.intervals_ms.median - 11.1)).toBeLessThan(0.05);
    expect(found.intervals_ms.longest).toBeCloseTo(16.1, 2);
    expect(found.script_ms!.count).toBe(found.intervals_ms.count);
  });

  it("leaves a session of a second alone, and what is not its own text", () => {
    const store = storage();
    const log = new HeadsetLog(store, { scriptMs: () => null, rateHz: () => null });
    log.begin("ar");
    for (let i = 0; i < 40; i++) log.recordFrame(i * 11);
    log.end();
    expect(lastHeadsetFrames(store)).toBeNull();
    for (const text of ["{", "3", "null", '{"mode":"vr"}']) {
      store.setItem("cathxr.diag.headset", text);
      expect(lastHeadsetFrames(store)).toBeNull();
    }
  });
});

const spread = { count: 600, median: 16.7, p95: 17, p99: 18, longest: 40, over: 3 };
const report: DiagReport = {
  schema: "cathxr-diag/1", software: "cathxr 1", seconds: 10,
  device: {
    user_agent: "A browser", secure: true, webxr: true, vr: true, ar: false, screen_px: [1, 1], pixel_ratio: 1, cores: 2,
    memory_gb: null, touch_points: 0,
  },
  graphics: {
    webgl2: true, vendor: "", renderer: "Some GPU", version: "", max_texture: 8192, max_texture_3d: 2048, max_samples: 4,
    max_uniform_vectors: 1024, extensions: [],
  },
  frames_ms: spread, draw_ms: null,
  link: { connected: true, round_trip_ms: spread, track_age_ms: spread, track_interval_ms: spread, skipped: 0 },
  headset: null,
};

describe("a measurement in words", () => {
  it("says what matters", () => {
    expect(verdict(report)).toBe("The page gets 60 frames a second. What is seen is 17 ms old when it arrives. A headset can be entered here.");
    expect(verdict({ ...report, graphics: { ...report.graphics, webgl2: false } })).toContain("no WebGL 2");
    expect(verdict({ ...report, headset: { mode: "vr", seconds: 9, rate_hz: 90, intervals_ms: { ...spread, median: 11.1, over: 30 }, script_ms: null } }))
      .toContain("90 frames a second, 5.0 % of them late");
    expect(verdict({ ...report, device: { ...report.device, secure: false, webxr: false, vr: false } })).toContain("https");
  });

  it("has a card for everything, also for what was not measured", () => {
    expect(cardsOf(report).map(({ title }) => title)).toEqual(["This page's frames", "Link", "Graphics", "Device"]);
    expect(JSON.stringify(cardsOf({ ...report, frames_ms: null }))).toContain("not measured");
  });
});

describe("the way into a headset", () => {
  it("names the address, the certificate and the code", () => {
    const access = { local: "http://127.0.0.1:8765", port: 8765, network: ["https://192.0.2.7:8766"], fingerprint: "AA:BB:CC:DD:EE:FF:00:11:22", has_code: true };
    const text = stepsFor(access).map(({ code }) => code).join(" ");
    expect(text).toContain("https://192.0.2.7:8766");
    expect(text).toContain("AA:BB:CC:DD:EE:FF:00:11");
    expect(stepsFor(access).length).toBe(4);
    expect(stepsFor({ ...access, network: [] })[0]!.code).toBe("cathxr run --lan");
    expect(cableStep(access).code).toBe("adb reverse tcp:8765 tcp:8765");
  });
});

describe("a slider's value", () => {
  it("is read with its unit", () => {
    expect(valueText({ key: "gainDb", unit: "dB", step: 1, high: 30 }, -6)).toBe("−6 dB");
    expect(valueText({ key: "gainDb", unit: "dB", step: 1, high: 30 }, 6)).toBe("+6 dB");
    expect(valueText({ key: "frequencyMHz", unit: "MHz", step: 0.5, high: 12 }, 7.5)).toBe("7.5 MHz");
    expect(valueText({ key: "sectorDeg", unit: "°", step: 5, high: 120 }, 90)).toBe("90°");
    expect(valueText({ key: "teaching", unit: "", step: 0.1, high: 1 }, 0.3)).toBe("30 %");
  });
});
