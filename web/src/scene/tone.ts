/** The tone when a target is reached. */

/** Two rising notes, as an answer in the affirmative. */
const NOTES_HZ = [660, 990];
const NOTE_S = 0.12;
const LOUDNESS = 0.16;

export class ReachedTone {
  private context: AudioContext | null = null;

  constructor(private readonly notesHz: readonly number[] = NOTES_HZ, private readonly loudness = LOUDNESS) {}

  /** Makes ready for sound; browsers allow that only while a person touches the page. */
  wake(): void {
    if (typeof AudioContext === "undefined") return;
    this.context ??= new AudioContext();
    void this.context.resume().catch(() => undefined);
  }

  play(): void {
    const { context } = this;
    if (context === null || context.state !== "running") return;
    this.notesHz.forEach((frequency, i) => {
      const begin = context.currentTime + i * NOTE_S;
      const gain = context.createGain();
      const tone = context.createOscillator();
      tone.frequency.value = frequency;
      gain.gain.setValueAtTime(0.0001, begin);
      gain.gain.exponentialRampToValueAtTime(this.loudness, begin + 0.015);
      gain.gain.exponentialRampToValueAtTime(0.001, begin + NOTE_S * (i + 1.6));
      tone.connect(gain).connect(context.destination);
      tone.start(begin);
      tone.stop(begin + NOTE_S * (i + 1.7));
    });
  }
}
