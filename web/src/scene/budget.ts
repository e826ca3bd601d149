/** Lowers the resolution of the 3D view by itself while frames are slow. */

const SLOW_MS = 36;
const PATIENCE_FRAMES = 24;
const PAUSE_MS = 400; // a longer gap is a hidden tab or a pause, not a slow frame
const LOWEST = 0.6;

export class FrameBudget {
  private lastMs = -Infinity;
  private slow = 0;

  constructor(
    public pixelRatio: number,
    private readonly automatic: boolean,
  ) {}

  /** Takes the instant of a drawn frame; returns whether the pixel ratio was lowered. Never raises it: no flicker. */
  frame(nowMs: number): boolean {
    const took = nowMs - this.lastMs;
    this.lastMs = nowMs;
    if (!this.automatic || took > PAUSE_MS) return false;
    this.slow = Math.max(0, this.slow + (took > SLOW_MS ? 1 : -1));
    if (this.slow < PATIENCE_FRAMES || this.pixelRatio <= LOWEST) return false;
    this.slow = 0;
    this.pixelRatio = Math.max(LOWEST, this.pixelRatio * 0.75);
    return true;
  }

  /** Says that nothing was drawn: the next interval says nothing about speed. */
  rest(): void {
    this.lastMs = -Infinity;
  }
}
