import { describe, expect, it } from "vitest";
import { ClockOffset } from "../src/link/clock";

describe("ClockOffset", () => {
  it("knows nothing before the first answer", () => {
    expect(new ClockOffset().offsetS).toBeNull();
  });

  it("believes the shortest round trip, whose error is at most half of it", () => {
    const clock = new ClockOffset();
    const truth = 5000.25;
    // Sent at s, `there` on the way to the host, `back` on the way home.
    for (const [s, there, back] of [[1, 0.08, 0.001], [2, 0.002, 0.001], [3, 0.001, 0.2]] as const) {
      clock.add(s, s + there + truth, s + there + back);
    }
    expect(Math.abs(clock.offsetS! - truth)).toBeLessThanOrEqual(0.0015);
    expect(clock.roundTripS).toBeCloseTo(0.003, 9);
  });

  it("lets old measurements go, as clocks drift", () => {
    const clock = new ClockOffset();
    clock.add(0, 100, 0.001);
    clock.add(70, 70 + 100.5 + 0.01, 70.02);
    expect(clock.offsetS).toBeCloseTo(100.5, 6);
  });

  it("forgets everything when told", () => {
    const clock = new ClockOffset();
    clock.add(0, 1, 0.1);
    clock.clear();
    expect(clock.offsetS).toBeNull();
    clock.add(10, 5, 10.5);
    expect(clock.offsetS).toBeCloseTo(-5.25, 9);
  });
});
