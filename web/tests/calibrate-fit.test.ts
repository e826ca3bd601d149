import { describe, expect, it } from "vitest";
import type { Vector2 } from "../src/generated/messages";
import type { Size, Zoom } from "../src/calibrate/fit";
import {
  clamped, COARSE_NUDGE_PX, fitted, isInside, MOST_ZOOM, NUDGE_PX, nudged, panned, toCanvas, toPicture, WHOLE, zoomed,
} from "../src/calibrate/fit";
import { placedLabels } from "../src/calibrate/labels";
import { LOUPE_SIZE, loupeAcross, loupeCorner, loupeSource } from "../src/calibrate/loupe";
import { arrowEnd } from "../src/calibrate/marker_overlay";

const PICTURE: Size = { width: 1280, height: 720 };
const TALL: Size = { width: 465, height: 530 };
const WIDE: Size = { width: 1400, height: 400 };
const ZOOMS: Zoom[] = [WHOLE, { factor: 3.7, x: 0.2, y: 0.9 }, { factor: 24, x: 1, y: 0 }];

describe("picture and canvas", () => {
  it("puts the picture in the middle, with margins above and below or left and right", () => {
    const tall = fitted(PICTURE, TALL);
    expect(tall.scale).toBeCloseTo(465 / 1280, 12);
    expect(tall.left).toBe(0);
    expect(tall.top).toBeCloseTo((530 - 720 * tall.scale) / 2, 9);
    const wide = fitted(PICTURE, WIDE);
    expect(wide.scale).toBeCloseTo(400 / 720, 12);
    expect(wide.top).toBe(0);
    expect(wide.left).toBeCloseTo((1400 - 1280 * wide.scale) / 2, 9);
  });

  it("has the first pixel's centre half a pixel inside the picture's corner", () => {
    const fit = fitted(PICTURE, TALL);
    expect(toCanvas(fit, [-0.5, -0.5])).toEqual([fit.left, fit.top]);
    const [x, y] = toCanvas(fit, [0, 0]);
    expect(x).toBeCloseTo(fit.left + fit.scale / 2, 12);
    expect(y).toBeCloseTo(fit.top + fit.scale / 2, 12);
    const [right, bottom] = toCanvas(fit, [1279.5, 719.5]);
    expect(right).toBeCloseTo(fit.left + 1280 * fit.scale, 9);
    expect(bottom).toBeCloseTo(fit.top + 720 * fit.scale, 9);
  });

  it("comes back to the same pixel, whatever the canvas and the zoom", () => {
    for (const canvas of [TALL, WIDE]) {
      for (const zoom of ZOOMS) {
        const fit = fitted(PICTURE, canvas, zoom);
        for (const pixel of [[0, 0], [1279, 719], [333.25, 41.75]] as Vector2[]) {
          const [u, v] = toPicture(fit, toCanvas(fit, pixel));
          expect(u).toBeCloseTo(pixel[0], 8);
          expect(v).toBeCloseTo(pixel[1], 8);
        }
      }
    }
  });

  it("knows what lies in the picture", () => {
    expect(isInside([-0.5, 719.5], PICTURE)).toBe(true);
    expect(isInside([-0.6, 10], PICTURE)).toBe(false);
    expect(clamped([-9, 9999], PICTURE)).toEqual([-0.5, 719.5]);
  });
});

describe("zoom", () => {
  it("holds what is under the pointer fast, from the whole picture on, also where that has margins", () => {
    for (const canvas of [TALL, WIDE]) {
      const whole = fitted(PICTURE, canvas);
      for (const pixel of [[5, 5], [801, 263], [1279, 719]] as Vector2[]) {
        const at = toCanvas(whole, pixel);
        let zoom = WHOLE;
        for (const factor of [1.3, 2, 3, 0.5, 1.2]) {
          zoom = zoomed(zoom, factor, at, PICTURE, canvas);
          const [u, v] = toPicture(fitted(PICTURE, canvas, zoom), at);
          expect(u).toBeCloseTo(pixel[0], 6);
          expect(v).toBeCloseTo(pixel[1], 6);
        }
        expect(zoom.factor).toBeCloseTo(1.3 * 2 * 3 * 0.5 * 1.2, 9);
        expect(fitted(PICTURE, canvas, zoomed(zoom, 0.01, at, PICTURE, canvas))).toEqual(whole);
      }
    }
  });

  it("lets no edge come farther in than without zoom, and ends somewhere", () => {
    const whole = fitted(PICTURE, WIDE);
    let zoom = zoomed(WHOLE, 5, [0, 0], PICTURE, WIDE);
    zoom = panned(zoom, [1e6, 1e6], PICTURE, WIDE);
    const [left, top] = toCanvas(fitted(PICTURE, WIDE, zoom), [-0.5, -0.5]);
    expect(left).toBeCloseTo(whole.left, 6);
    expect(top).toBeCloseTo(whole.top, 6);
    zoom = panned(zoom, [-1e6, -1e6], PICTURE, WIDE);
    const [right, bottom] = toCanvas(fitted(PICTURE, WIDE, zoom), [1279.5, 719.5]);
    expect(right).toBeCloseTo(WIDE.width - whole.left, 6);
    expect(bottom).toBeCloseTo(WIDE.height - whole.top, 6);
    expect(zoomed(zoom, 1e-9, [0, 0], PICTURE, WIDE).factor).toBe(1);
    expect(zoomed(zoom, 1e9, [0, 0], PICTURE, WIDE).factor).toBe(MOST_ZOOM);
  });

  it("moves the picture with the pointer", () => {
    const zoom: Zoom = { factor: 8, x: 0.5, y: 0.5 };
    const before = toCanvas(fitted(PICTURE, TALL, zoom), [640, 360]);
    const after = toCanvas(fitted(PICTURE, TALL, panned(zoom, [12, -7], PICTURE, TALL)), [640, 360]);
    expect(after[0] - before[0]).toBeCloseTo(12, 6);
    expect(after[1] - before[1]).toBeCloseTo(-7, 6);
  });
});

describe("nudge", () => {
  it("moves by a quarter of a pixel, with Shift by more, and stays in the picture", () => {
    expect(nudged([10, 20], "ArrowRight", false, PICTURE)).toEqual([10 + NUDGE_PX, 20]);
    expect(nudged([10, 20], "ArrowUp", false, PICTURE)).toEqual([10, 20 - NUDGE_PX]);
    expect(nudged([10, 20], "ArrowDown", true, PICTURE)).toEqual([10, 20 + COARSE_NUDGE_PX]);
    expect(nudged([-0.4, 20], "ArrowLeft", false, PICTURE)).toEqual([-0.5, 20]);
    expect(nudged([10, 20], "a", false, PICTURE)).toBeNull();
    expect(NUDGE_PX).toBe(0.25);
  });
});

describe("loupe", () => {
  it("has the place that is meant in its middle, also in a picture of fewer pixels than the camera's", () => {
    const full = loupeSource([100, 50], 21, PICTURE, PICTURE);
    expect(full).toEqual({ left: 90, top: 40, width: 21, height: 21 });
    const half = loupeSource([100, 50], 21, PICTURE, { width: 640, height: 360 });
    expect(half).toEqual({ left: 45, top: 20, width: 10.5, height: 10.5 });
  });

  it("enlarges at least four times and shows whole pixels about a middle one", () => {
    for (const scale of [0.2, 0.36, 1, 3, 12]) {
      const across = loupeAcross(scale);
      expect(across % 2).toBe(1);
      expect(LOUPE_SIZE / across).toBeGreaterThanOrEqual(Math.min(4 * scale, LOUPE_SIZE / 7) * 0.9);
    }
  });

  it("stays on the canvas and never lies under the pointer or the finger", () => {
    for (const canvas of [TALL, { width: 374, height: 210 }]) {
      for (let x = 0; x <= canvas.width; x += 31) {
        for (let y = 0; y <= canvas.height; y += 31) {
          for (const finger of [false, true]) {
            const [left, top] = loupeCorner([x, y], canvas, finger);
            expect(left).toBeGreaterThanOrEqual(0);
            expect(top).toBeGreaterThanOrEqual(0);
            expect(left + LOUPE_SIZE).toBeLessThanOrEqual(canvas.width);
            expect(top + LOUPE_SIZE).toBeLessThanOrEqual(canvas.height);
            const apart = Math.hypot(left + LOUPE_SIZE / 2 - x, top + LOUPE_SIZE / 2 - y);
            expect(apart, `${x} ${y} ${finger}`).toBeGreaterThan(LOUPE_SIZE / 2);
          }
        }
      }
    }
  });
});

describe("what stands beside a marker", () => {
  it("draws a residual in its direction, a ring's radius for 0.05 px, and not across the picture", () => {
    expect(arrowEnd([0, 0], 11)).toEqual([0, 0]);
    const [dx, dy] = arrowEnd([0.03, -0.04], 11);
    expect(dx).toBeCloseTo(6.6, 9);
    expect(dy).toBeCloseTo(-8.8, 9);
    expect(Math.hypot(...arrowEnd([300, 400], 11))).toBeCloseTo(8 * 11, 6);
  });

  it("writes names where they cover neither each other nor a marker", () => {
    const items = [[100, 100], [130, 102], [100, 140], [390, 100]].map(([x, y]) => ({ at: [x, y] as Vector2, radius: 11, width: 90 }));
    const boxes = placedLabels(items, 18, { width: 400, height: 300 });
    for (const [i, a] of boxes.entries()) {
      expect(a.left).toBeGreaterThanOrEqual(0);
      expect(a.left + a.width).toBeLessThanOrEqual(400);
      for (const [j, b] of boxes.entries()) {
        const apart = a.left + a.width <= b.left || b.left + b.width <= a.left || a.top + a.height <= b.top || b.top + b.height <= a.top;
        expect(i === j || apart, `${i} over ${j}`).toBe(true);
      }
    }
  });
});
