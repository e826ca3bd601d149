/** Numbers as people read them. A true minus sign keeps columns of digits aligned; a dash says that there is no value. */

export const NO_VALUE = "–";
const DEGREES = 180 / Math.PI;

/** Returns a number with `digits` decimals, e.g. "−12.3"; a dash for null and anything that is not finite. */
export function fixed(value: number | null | undefined, digits: number): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return NO_VALUE;
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? `−${text}` : text;
}

/** Returns radians as degrees, e.g. "−90.0". */
export function degrees(radians: number | null | undefined, digits = 1): string {
  return fixed(radians === null || radians === undefined ? null : radians * DEGREES, digits);
}

/** Returns a duration as "m:ss" or "h:mm:ss". */
export function duration(seconds: number): string {
  const whole = Math.max(0, Math.floor(seconds));
  const two = (n: number): string => String(n).padStart(2, "0");
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor(whole / 60) % 60;
  return hours > 0 ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

/** Returns a sentence that begins with a capital and ends with a full stop. */
export function sentence(text: string): string {
  const trimmed = text.trim();
  if (trimmed === "") return "";
  const begun = trimmed[0]!.toUpperCase() + trimmed.slice(1);
  return /[.!?…]$/.test(begun) ? begun : `${begun}.`;
}

/** Returns text in which no line ends between a number and its unit. */
export function withUnits(text: string): string {
  return text.replaceAll(/(\d) (%|px|mm|ms|s|°)(?![a-z])/g, "$1\u00a0$2");
}
