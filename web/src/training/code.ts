/** Codes of participants, as `core/participant_code.py` judges them: what is wrong is said before the server is asked. */

const SHAPE = /^[A-Z0-9]+(?:-[A-Z0-9]+)*$/;
const YEAR = /(?<!\d)(?:19|20)\d\d(?!\d)/;
const LONGEST = 12;
const MOST_DIGITS = 5;
const EXAMPLE = "Use a code such as P01 or EXP12, and keep the list of who is who elsewhere.";

/** What a code may be written with. */
export const CODE_KEYS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-";

/** Returns what is typed as a code is written: in capitals, without spaces. */
export function asCode(typed: string): string {
  return typed.trim().toUpperCase();
}

/** Returns why this is no participant's code, as a sentence; empty where it is a good one. */
export function codeTrouble(code: string): string {
  if (code === "") return `Whose trial is it? ${EXAMPLE}`;
  if (code.length < 2 || code.length > LONGEST || !SHAPE.test(code)) {
    return `A code has 2 to ${LONGEST} capitals, digits and hyphens. ${EXAMPLE}`;
  }
  if (!/\d/.test(code) || /[A-Z]{4}/.test(code)) return `${code} looks like a name. ${EXAMPLE}`;
  const digits = code.match(/\d/g)!.length;
  if (digits > MOST_DIGITS || YEAR.test(code) || code.match(/\d+/g)!.length > 2) {
    return `${code} looks like a date or a person's number. ${EXAMPLE}`;
  }
  return "";
}
