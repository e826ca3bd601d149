/** One measurement: the page's frames, the link, the graphics. */

import type { DiagReport, HeadsetFrames, Hello, ServerMessage, TrackMessage } from "../generated/messages";
import { Link } from "../link/link";
import { deviceOf, graphicsOf } from "./capabilities";
import { SpreadMeter } from "./spread";
import { TestPicture } from "./test_picture";

export const MEASURE_S = 10;
const PING_EVERY_MS = 100;
/** Test pictures come after the frames were measured, which they would hold up. */
const PICTURES = 12;
const PICTURES_S = 6;

export class Probe {
  private readonly frames = new SpreadMeter();
  private readonly roundTrips = new SpreadMeter();
  private readonly ages = new SpreadMeter();
  private readonly intervals = new SpreadMeter();
  private readonly draws = new SpreadMeter();
  private readonly link: Link;
  private software = "";
  private connected = false;
  private lastSeq = -1;
  private lastTrackMs = 0;
  private skipped = 0;

  constructor(linkUrl: string) {
    this.link = new Link(linkUrl, {
      onState: ({ phase }) => (this.connected = phase === "live"),
      onHello: (hello) => this.greet(hello),
      onMessage: (message) => this.take(message),
      onRoundTrip: (seconds) => this.roundTrips.add(1000 * seconds),
    });
  }

  /** Measures, and tells how far it has got (0 to 1). Never rejects: what cannot be measured is null. */
  async measure(headset: HeadsetFrames | null, onShare: (share: number) => void): Promise<DiagReport> {
    const begunMs = performance.now();
    this.link.start();
    const pings = setInterval(() => this.link.send({ type: "ping", t: performance.now() / 1000 }), PING_EVERY_MS);
    await this.watchFrames(onShare);
    clearInterval(pings);
    const connected = this.connected;
    this.link.stop();
    const gl = document.createElement("canvas").getContext("webgl2", { powerPreference: "high-performance" });
    const graphics = graphicsOf(gl);
    if (gl !== null) await this.drawPictures(gl);
    onShare(1);
    return {
      schema: "cathxr-diag/1",
      software: this.software,
      seconds: Math.round((performance.now() - begunMs) / 100) / 10,
      device: await deviceOf(),
      graphics,
      frames_ms: this.frames.spread(),
      draw_ms: this.draws.spread(),
      link: {
        connected,
        round_trip_ms: this.roundTrips.spread(),
        track_age_ms: this.ages.spread(),
        track_interval_ms: this.intervals.spread(),
        skipped: this.skipped,
      },
      headset,
    };
  }

  private greet(hello: Hello): void {
    this.software = hello.software;
    this.lastSeq = -1;
  }

  private take(message: ServerMessage): void {
    if (message.type === "track") this.takeTrack(message);
  }

  private takeTrack(track: TrackMessage): void {
    const nowMs = performance.now();
    this.link.acknowledge(track.seq);
    if (this.lastSeq >= 0) {
      this.intervals.add(nowMs - this.lastTrackMs);
      this.skipped += Math.max(0, track.seq - this.lastSeq - 1);
    }
    this.lastSeq = track.seq;
    this.lastTrackMs = nowMs;
    const { offsetS } = this.link.clock;
    if (track.latency_ms !== null && offsetS !== null) this.ages.add(nowMs + 1000 * (offsetS - track.t));
  }

  private watchFrames(onShare: (share: number) => void): Promise<void> {
    return new Promise((resolve) => {
      const begunMs = performance.now();
      let lastMs = -1;
      const frame = (nowMs: number): void => {
        // A hidden page gets no frames: that says nothing of the device.
        if (lastMs >= 0 && !document.hidden) this.frames.add(nowMs - lastMs);
        lastMs = document.hidden ? -1 : nowMs;
        onShare(Math.min(0.9, (0.9 * (performance.now() - begunMs)) / (1000 * MEASURE_S)));
        if (performance.now() - begunMs < 1000 * MEASURE_S) requestAnimationFrame(frame);
        else resolve();
      };
      requestAnimationFrame(frame);
    });
  }

  private async drawPictures(gl: WebGL2RenderingContext): Promise<void> {
    try {
      const picture = new TestPicture(gl);
      const begunMs = performance.now();
      picture.draw(); // the first one also makes the program
      for (let i = 0; i < PICTURES && performance.now() - begunMs < 1000 * PICTURES_S; i++) {
        this.draws.add(picture.draw());
        await new Promise((resolve) => setTimeout(resolve, 20));
      }
    } catch {
      // its absence from the report says so
    }
    gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}
