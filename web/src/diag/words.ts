/** A measurement in words: one sentence that judges, and cards of figures. */

import type { DiagReport, Spread } from "../generated/messages";

export type Level = "plain" | "good" | "warn" | "bad";

export interface Figure {
  readonly name: string;
  readonly value: string;
  readonly level: Level;
  /** In small letters below; empty: nothing. */
  readonly more: string;
}

export interface Card {
  readonly title: string;
  readonly figures: readonly Figure[];
}

/** Fewer times than this are not judged. */
const FEW = 20;

/** Returns what matters most about a device, in one or two sentences. */
export function verdict(report: DiagReport): string {
  const { device, graphics, frames_ms: frames, link, headset } = report;
  if (!graphics.webgl2) return "This browser offers no WebGL 2: the scene cannot be drawn here. Update the browser or turn its hardware acceleration on.";
  const parts: string[] = [];
  if (headset !== null) {
    const share = headset.intervals_ms.over / headset.intervals_ms.count;
    parts.push(`In the headset: ${rate(headset.intervals_ms.median)} frames a second, ${percent(share)} of them late.`);
  } else if (frames !== null) {
    parts.push(`The page gets ${rate(frames.median)} frames a second.`);
  }
  if (!link.connected) parts.push("There is no link to the server.");
  else if (link.track_age_ms !== null) parts.push(`What is seen is ${link.track_age_ms.median.toFixed(0)} ms old when it arrives.`);
  parts.push(
    device.vr ? "A headset can be entered here."
    : device.webxr ? "No headset is connected to this browser."
    : device.secure ? "This browser knows no headsets (WebXR)."
    : "Headsets need a secure address (https); this one is not.",
  );
  return parts.join(" ");
}

/** Returns all figures, in groups. */
export function cardsOf(report: DiagReport): readonly Card[] {
  const { device, graphics, link, headset } = report;
  const cards: Card[] = [];
  if (headset !== null) {
    const { mode, seconds, rate_hz: hz, intervals_ms: intervals, script_ms: script } = headset;
    cards.push({
      title: `Last session in ${mode.toUpperCase()}, ${seconds.toFixed(0)} s`,
      figures: [
        figure("Headset's rate", hz === null ? "not said" : `${hz.toFixed(0)} Hz`),
        ...spreadFigures("Between frames", intervals, lateLevel(intervals)),
        ...(script === null ? [] : spreadFigures("JavaScript", script, script.p95 < 3 ? "good" : script.p95 < 6 ? "warn" : "bad")),
      ],
    });
  }
  cards.push(
    { title: "This page's frames", figures: spreadFigures("Between frames", report.frames_ms, lateLevel(report.frames_ms)) },
    {
      title: "Link",
      figures: [
        figure("Link", link.connected ? "connected" : "none", link.connected ? "good" : "bad"),
        ...spreadFigures("Round trip", link.round_trip_ms, link.round_trip_ms === null ? "plain" : link.round_trip_ms.p95 < 20 ? "good" : link.round_trip_ms.p95 < 60 ? "warn" : "bad"),
        ...spreadFigures("Age of Tracks", link.track_age_ms),
        ...spreadFigures("Between Tracks", link.track_interval_ms),
        figure("Tracks skipped", String(link.skipped)),
      ],
    },
    {
      title: "Graphics",
      figures: [
        figure("WebGL 2", graphics.webgl2 ? "yes" : "no", graphics.webgl2 ? "good" : "bad"),
        figure("Renderer", graphics.renderer || "not said", /swiftshader|llvmpipe|software/i.test(graphics.renderer) ? "warn" : "plain"),
        ...spreadFigures("Test picture", report.draw_ms),
        figure("Largest texture", `${graphics.max_texture} px, 3D ${graphics.max_texture_3d}`),
        figure("Samples", String(graphics.max_samples)),
        figure("Extensions", String(graphics.extensions.length)),
      ],
    },
    {
      title: "Device",
      figures: [
        figure("Secure address", yes(device.secure), device.secure ? "good" : "warn"),
        figure("WebXR", yes(device.webxr), device.webxr ? "good" : "plain"),
        figure("VR, AR", `${yes(device.vr)}, ${yes(device.ar)}`, device.vr || device.ar ? "good" : "plain"),
        figure("Screen", `${device.screen_px[0]} × ${device.screen_px[1]} px, ${device.pixel_ratio} per CSS pixel`),
        figure("Processor cores", device.cores === 0 ? "not said" : String(device.cores)),
        figure("Memory", device.memory_gb === null ? "not said" : `${device.memory_gb} GB or more`),
        figure("Browser", device.user_agent),
      ],
    },
  );
  return cards;
}

function spreadFigures(name: string, spread: Spread | null, level: Level = "plain"): Figure[] {
  if (spread === null) return [figure(name, "not measured")];
  const more = `95 % under ${ms(spread.p95)}, 99 % under ${ms(spread.p99)}, longest ${ms(spread.longest)} ms of ${spread.count}`;
  return [figure(name, `${ms(spread.median)} ms`, spread.count < FEW ? "plain" : level, more)];
}

/** Late frames are those that took half as long again as the median: a picture was shown twice. */
function lateLevel(spread: Spread | null): Level {
  if (spread === null || spread.count === 0) return "plain";
  const share = spread.over / spread.count;
  return share < 0.01 ? "good" : share < 0.05 ? "warn" : "bad";
}

function figure(name: string, value: string, level: Level = "plain", more = ""): Figure {
  return { name, value, level, more };
}

function ms(value: number): string {
  return value.toFixed(value < 100 ? 1 : 0);
}

function rate(intervalMs: number): string {
  return intervalMs > 0 ? (1000 / intervalMs).toFixed(intervalMs > 100 ? 1 : 0) : "no";
}

function percent(share: number): string {
  return `${(100 * share).toFixed(share < 0.1 ? 1 : 0)} %`;
}

function yes(value: boolean): string {
  return value ? "yes" : "no";
}
