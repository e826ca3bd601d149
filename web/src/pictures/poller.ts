/** Fetches one camera's pictures one after the other: the server holds each request until there is a newer picture. */

export interface Picture {
  readonly bitmap: ImageBitmap;
  /** The picture pair's number: the Track's seq. */
  readonly seq: number;
}

export interface PollerHandlers {
  /** Takes the picture and closes its bitmap when done with it. */
  onPicture(picture: Picture): void;
  /** Says why there are no pictures, as a short phrase; empty when there are again. */
  onTrouble(phrase: string): void;
}

const RETRY_MS = 1500;

export class PicturePoller {
  /** Width asked for, pixels: the same few for all clients, so that they share the server's work. */
  width = 640;
  private stopped: AbortController | null = null;
  private after = -1;

  constructor(
    private readonly camera: string,
    private readonly picturesHz: number,
    private readonly handlers: PollerHandlers,
  ) {}

  get running(): boolean {
    return this.stopped !== null;
  }

  start(): void {
    if (this.stopped !== null || this.picturesHz <= 0) return;
    this.stopped = new AbortController();
    this.after = -1;
    void this.loop(this.stopped.signal);
  }

  stop(): void {
    this.stopped?.abort();
    this.stopped = null;
  }

  private async loop(signal: AbortSignal): Promise<void> {
    while (!signal.aborted) {
      const begun = performance.now();
      try {
        await this.once(signal);
      } catch {
        if (signal.aborted) return;
        this.handlers.onTrouble("no answer from the server");
        await pause(RETRY_MS, signal);
      }
      await pause(Math.max(0, 1000 / this.picturesHz - 2 - (performance.now() - begun)), signal);
    }
  }

  private async once(signal: AbortSignal): Promise<void> {
    const url = `cameras/${encodeURIComponent(this.camera)}.jpg?after=${this.after}&width=${this.width}`;
    const response = await fetch(url, { signal, cache: "no-store" });
    if (response.status === 204) {
      this.handlers.onTrouble("no new pictures");
      return;
    }
    if (!response.ok) {
      this.handlers.onTrouble(response.status === 404 ? "this source has no pictures" : "no pictures");
      await pause(RETRY_MS, signal);
      return;
    }
    const seq = Number(response.headers.get("X-Cathxr-Seq") ?? "-1");
    const bitmap = await createImageBitmap(await response.blob());
    if (signal.aborted) {
      bitmap.close();
      return;
    }
    this.after = seq;
    this.handlers.onTrouble("");
    this.handlers.onPicture({ bitmap, seq });
  }
}

function pause(ms: number, signal: AbortSignal): Promise<void> {
  if (ms <= 0 || signal.aborted) return Promise.resolve();
  return new Promise((resolve) => {
    const done = (): void => {
      clearTimeout(timer);
      signal.removeEventListener("abort", done);
      resolve();
    };
    const timer = setTimeout(done, ms);
    signal.addEventListener("abort", done);
  });
}
