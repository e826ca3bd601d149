/** A short tone for each captured view, when a person has turned it on. */

import { byId } from "../ui/dom";

const REMEMBERED_AS = "cathxr-calibration-sound";

export class Sound {
  private readonly button = byId<HTMLButtonElement>("sound");
  private context: AudioContext | null = null;
  private on = remembered();

  constructor() {
    this.button.addEventListener("click", () => {
      this.on = !this.on;
      remember(this.on);
      this.refresh();
      if (this.on) this.capture();
    });
    this.refresh();
  }

  capture(): void {
    if (!this.on || typeof AudioContext === "undefined") return;
    this.context ??= new AudioContext();
    const { context } = this;
    void context.resume().catch(() => undefined); // no tone before the person has touched the page
    const begin = context.currentTime;
    const gain = context.createGain();
    const tone = context.createOscillator();
    tone.frequency.setValueAtTime(880, begin);
    tone.frequency.setValueAtTime(1320, begin + 0.07);
    gain.gain.setValueAtTime(0.18, begin);
    gain.gain.exponentialRampToValueAtTime(0.001, begin + 0.25);
    tone.connect(gain).connect(context.destination);
    tone.start(begin);
    tone.stop(begin + 0.26);
  }

  private refresh(): void {
    this.button.setAttribute("aria-pressed", String(this.on));
    this.button.title = this.on ? "A tone for each captured view: on" : "A tone for each captured view: off";
  }
}

function remembered(): boolean {
  try {
    return localStorage.getItem(REMEMBERED_AS) === "on";
  } catch {
    return false; // this browser remembers nothing
  }
}

function remember(on: boolean): void {
  try {
    localStorage.setItem(REMEMBERED_AS, on ? "on" : "off");
  } catch {
    // the switch works for as long as the page is open
  }
}
