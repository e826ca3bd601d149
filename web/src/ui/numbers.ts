/** The figures beside the scene. */

import type { HealthMessage, SourceHealth, TrackMessage } from "../generated/messages";
import { degrees, fixed, NO_VALUE } from "../maths/format";
import { polylineLength } from "../maths/centreline";
import { byId, make, setText } from "./dom";

const IDS = [
  "tip-x", "tip-y", "tip-z", "yaw", "pitch", "roll", "length", "sigma",
  "track-rate", "picture-rate", "latency-page", "latency-track", "skew", "clients",
] as const;
type Id = (typeof IDS)[number];

export interface LinkFigures {
  readonly trackRate: number;
  readonly pictureRate: number;
  /** Median from mid-exposure to this page, ms; null where unknown. */
  readonly latencyMs: number | null;
  /** Median from mid-exposure to the finished Track, ms; null where unknown. */
  readonly trackLatencyMs: number | null;
}

export class Numbers {
  private readonly fields = Object.fromEntries(IDS.map((id) => [id, byId(id)])) as Record<Id, HTMLElement>;
  private readonly sources = byId("sources");
  private shownSources = "";

  constructor() {
    for (const id of IDS) this.set(id, NO_VALUE);
  }

  showTrack(track: TrackMessage | null): void {
    const position = track?.tip?.position;
    this.set("tip-x", fixed(position?.[0], 1));
    this.set("tip-y", fixed(position?.[1], 1));
    this.set("tip-z", fixed(position?.[2], 1));
    this.set("yaw", degrees(track?.yaw));
    this.set("pitch", degrees(track?.pitch));
    this.set("roll", degrees(track?.roll));
    this.set("length", fixed(track?.points ? polylineLength(track.points) : null, 1));
    this.set("sigma", fixed(track?.sigma_mm, 2));
  }

  showLink(figures: LinkFigures): void {
    this.set("track-rate", fixed(figures.trackRate, 1));
    this.set("picture-rate", fixed(figures.pictureRate, 1));
    this.set("latency-page", fixed(figures.latencyMs, 0));
    this.set("latency-track", fixed(figures.trackLatencyMs, 0));
  }

  showHealth(health: HealthMessage | null): void {
    this.set("skew", fixed(health?.skew_ms, 1));
    this.set("clients", health === null ? NO_VALUE : String(health.clients));
    const key = JSON.stringify(health?.sources.map((s) => [s.source, s.running, s.rate_hz.toFixed(1), s.losses, s.last_error]) ?? []);
    if (key === this.shownSources) return;
    this.shownSources = key;
    this.sources.replaceChildren(...(health?.sources ?? []).map(sourceItem));
  }

  private set(id: Id, text: string): void {
    setText(this.fields[id], text);
  }
}

function sourceItem(source: SourceHealth): HTMLLIElement {
  const item = make("li");
  item.dataset["level"] = !source.running ? "bad" : source.last_error !== null ? "warn" : "good";
  item.title = `${source.losses} lost or skipped so far`;
  item.append(make("span", "", source.source), make("span", "faint", source.running ? `${fixed(source.rate_hz, 0)} /s` : "stopped"));
  if (source.last_error !== null) item.append(make("span", "trouble", source.last_error));
  return item;
}
