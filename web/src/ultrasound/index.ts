/** The simulated ultrasound image; docs/ultrasound.md. */

export { FanGeometry, IceFan } from "./fan";
export { IceImager } from "./imager";
export { LabelVolume } from "./labels";
export { IcePanel } from "./panel";
export { ICE_DEFAULTS, ICE_SIZE, iceHzFrom, resolve } from "./settings";
export type { IceSettings, IceSize, Resolved } from "./settings";
export { ACOUSTIC_SCALES, AcousticVolume } from "./volume";
export type { AcousticScales } from "./volume";
