import { describe, expect, it } from "vitest";
import { depthStep, layout, MARGIN, pixel, shortName } from "../src/ultrasound/annotations";
import { FanGeometry } from "../src/ultrasound/fan";
import { ICE_DEFAULTS, ICE_SIZE, iceHzFrom, resolve } from "../src/ultrasound/settings";
import { AcousticVolume } from "../src/ultrasound/volume";

const UNIT = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

describe("settings", () => {
  it("refuses what a machine cannot do, and names it", () => {
    expect(() => resolve({ ...ICE_DEFAULTS, depthMm: 1000 }, ICE_SIZE)).toThrow(/depthMm: expected 10 to 300, got 1000/);
    expect(() => resolve({ ...ICE_DEFAULTS, gainDb: NaN }, ICE_SIZE)).toThrow(/gainDb/);
    expect(() => resolve({ ...ICE_DEFAULTS, tgcDb: [0] }, ICE_SIZE)).toThrow(/8 numbers/);
  });

  it("widens the beam at a lower frequency, within the shader's reach", () => {
    const [low, high] = [3, 10].map((frequencyMHz) => resolve({ ...ICE_DEFAULTS, frequencyMHz, depthMm: 20 }, ICE_SIZE));
    expect(low!.sigmaLateralRad).toBeGreaterThan(2 * high!.sigmaLateralRad);
    expect(low!.axialRadius).toBe(15);
    expect(low!.axial).toHaveLength(16);
  });

  it("takes the rate from the address", () => {
    expect(iceHzFrom("?iceHz=5")).toBe(5);
    expect(iceHzFrom("")).toBe(30);
    expect(iceHzFrom("?iceHz=fast")).toBe(30);
    expect(iceHzFrom("?iceHz=900")).toBe(60);
  });
});

describe("layout", () => {
  it.each([[Math.PI / 2, 90], [Math.PI, 60], [0.6, 160]])("keeps a sector of %f rad and %f mm within its margins", (sectorRad, depthMm) => {
    const settings = { ...ICE_DEFAULTS, sectorRad, depthMm };
    for (const distalLeft of [true, false]) {
      const at = layout(settings, 800, 640, distalLeft);
      for (let share = -1; share <= 1; share += 0.125) {
        for (const depth of [0, depthMm]) {
          const [x, y] = pixel(settings, at, depth, (share * sectorRad) / 2);
          expect(x).toBeGreaterThanOrEqual(MARGIN.side - 1e-6);
          expect(x).toBeLessThanOrEqual(800 - MARGIN.side + 1e-6);
          expect(y).toBeGreaterThanOrEqual(MARGIN.top - 1e-6);
          expect(y).toBeLessThanOrEqual(640 - MARGIN.bottom + 1e-6);
        }
      }
      expect(pixel(settings, at, depthMm, sectorRad / 2)[0] < at.x).toBe(distalLeft);
    }
  });

  it("labels three to nine depths", () => {
    for (let depth = 25; depth <= 300; depth += 5) {
      const count = Math.floor(depth / depthStep(depth));
      expect(count).toBeGreaterThanOrEqual(3);
      expect(count).toBeLessThanOrEqual(9);
    }
  });
});

describe("fan", () => {
  it("covers its sector and is rewritten in place", () => {
    const fan = new FanGeometry();
    fan.fit(Math.PI / 2, 90, 3);
    const places = fan.getAttribute("position");
    const array = places.array;
    const last = places.count - 1;
    expect(Math.atan2(places.getZ(last), places.getX(last) + 3)).toBeCloseTo(Math.PI / 4, 6);
    const reaches = Array.from({ length: places.count }, (_, i) => Math.hypot(places.getX(i) + 3, places.getZ(i)));
    expect(Math.max(...reaches)).toBeGreaterThan(93);
    expect(Math.max(...reaches)).toBeLessThan(93.2);
    fan.fit(1, 60, 5);
    expect(fan.getAttribute("position").array).toBe(array);
  });
});

describe("volume", () => {
  it("refuses bytes that do not fill it", () => {
    expect(() => new AcousticVolume(new Uint8Array(7), [1, 1, 2], UNIT)).toThrow(/should have 8 bytes and has 7/);
    expect(() => new AcousticVolume(new Uint8Array(8), [1, 1, 2], new Array(16).fill(0))).toThrow(/cannot be inverted/);
  });

  it("knows its voxels", () => {
    const matrix = [2, 0, 0, 5, 0, 3, 0, 6, 0, 0, 4, 7, 0, 0, 0, 1];
    const volume = new AcousticVolume(new Uint8Array(8), [1, 1, 2], matrix);
    expect(volume.spacingMm.toArray()).toEqual([2, 3, 4]);
    expect(volume.interfaceMm).toBeCloseTo(2.35 * 3, 9);
  });
});

describe("the legend", () => {
  it("writes names as echocardiographers do", () => {
    expect(["Left ventricle", "Superior vena cava", "Aorta", "left-atrial appendage"].map(shortName)).toEqual(["LV", "SVC", "Aorta", "LAA"]);
  });
});
