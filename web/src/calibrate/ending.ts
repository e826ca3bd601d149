/** How a calibration ended: said on the page, also when the server has stopped since. */

export interface Ending {
  readonly saved: boolean;
  readonly title: string;
  readonly sentence: string;
}

/**
 * Returns the ending that the answer to a command, or an event's payload, tells of; null where it goes on: what is
 * accepted may take some work first, and only an ending has a sentence.
 */
export function endingOf(told: Record<string, unknown>): Ending | null {
  const { saved, sentence } = told;
  if (typeof sentence !== "string" || sentence === "") return null;
  return { saved: saved === true, title: saved === true ? "Saved" : "Cancelled", sentence };
}
