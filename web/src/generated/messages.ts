// Generated from src/cathxr/wire/messages.py by `python -m cathxr.wire.generate`. Do not edit.

/** The protocol version that these types describe. */
export const PROTOCOL = 1;

/** Tracks in flight, at most, to a client that acknowledges. */
export const ACK_WINDOW = 12;

/** Why the server closed a link. */
export const CLOSE_CODE = {
  GOING_AWAY: 1001,
  TOO_BIG: 1009,
  NO_ANSWER: 1011,
  PROTOCOL: 4400,
  MISUSE: 4408,
  BUSY: 4429,
} as const;

export type Vector2 = [number, number];
export type Vector3 = [number, number, number];
export type Quaternion = [number, number, number, number];
export type Matrix4 = [number, number, number, number, number, number, number, number, number, number, number, number, number, number, number, number];

/** One result for people, with its unit, as text. level: how to colour it. */
export interface Figure {
  label: string;
  value: string;
  level: "plain" | "good" | "warn" | "bad";
}

/** A picture of a result. path: to GET from this server. */
export interface ResultPicture {
  title: string;
  path: string;
}

/** One picture of the board that was kept, or why it was not. */
export interface BoardView {
  name: string;
  kept: boolean;
  /** Why it was rejected; empty when kept. */
  reason: string;
}

/** How often a board's corner was in each cell of the picture: counts row by row. */
export interface Coverage {
  columns: number;
  rows: number;
  counts: number[];
}

/** A camera's lens being measured with a board. */
export interface IntrinsicsState {
  type: "calibrate_intrinsics";
  camera: string;
  stage: "collecting" | "solving" | "done" | "failed";
  /** What to do next, or what came of it: one sentence for a person. */
  advice: string;
  size_px: [number, number];
  /** The board's corners in the newest picture, px; empty: no board. */
  corners_px: Vector2[];
  /** seq of the picture in which the corners were found. */
  corners_seq: number;
  /** The board does not move. */
  is_still: boolean;
  /** This view adds to those kept. */
  is_new: boolean;
  coverage: Coverage;
  kept: number;
  /** Views that make a good calibration. */
  wanted: number;
  views: BoardView[];
  figures: Figure[];
  pictures: ResultPicture[];
}

/** One fiducial in one camera's picture. pixel: null where it is missing. */
export interface MarkerState {
  camera: string;
  name: string;
  colour: string;
  pixel: Vector2 | null;
  origin: "found" | "placed" | "missing" | "ambiguous";
  /** Measured minus projected, px; null without a solution. */
  residual: Vector2 | null;
  /** Its length. */
  residual_px: number | null;
}

/** The cameras' poses being measured with the fiducials. */
export interface MarkersState {
  type: "calibrate_markers";
  stage: "collecting" | "solving" | "done" | "failed";
  advice: string;
  /** Picture size of each camera. */
  sizes_px: Record<string, [number, number]>;
  markers: MarkerState[];
  /** The markers suffice for both poses, and the result may be saved. */
  can_save: boolean;
  figures: Figure[];
  pictures: ResultPicture[];
}

/** One camera device. key: its pictures are at /cameras/{key}.jpg. */
export interface DeviceState {
  key: string;
  /** What the configuration calls it: an index or a path. */
  device: string;
  label: string;
  role: "" | "top" | "front";
  /** What the fiducials in its picture say it is. */
  suggestion: "" | "top" | "front";
  /** Exposure, gain, focus, white balance as they stand. */
  settings: Figure[];
  /** Why it gives no pictures; empty when it does. */
  trouble: string;
}

/** Devices being told apart, and their settings locked. */
export interface CamerasState {
  type: "calibrate_cameras";
  stage: "collecting" | "solving" | "done" | "failed";
  advice: string;
  devices: DeviceState[];
  can_save: boolean;
  figures: Figure[];
}

/** The encoder's gear being rocked between its stops. Angles rad of the catheter, from where the handle was held. */
export interface RockingState {
  low_rad: number;
  high_rad: number;
  /** A range wider than this is no play. */
  limit_rad: number;
  /** Stops so far, on the side that has fewer. */
  stops: number;
  wanted: number;
}

/** The roll being measured in the jig. */
export interface RollCalibrationState {
  type: "calibrate_roll";
  stage: "collecting" | "solving" | "done" | "failed";
  step: "zero" | "backlash" | "turn" | "review";
  /** Those of this run, in order. */
  steps: ("zero" | "backlash" | "turn" | "review")[];
  advice: string;
  /** A simulated hand does the steps, without hardware. */
  is_simulated: boolean;
  /** The encoder reports. */
  connected: boolean;
  /** The board's count; null without an encoder. */
  count: number | null;
  /** From where the handle was confirmed, or else from where it began. */
  turned_rad: number | null;
  /** Where mark T points at zero, seen from the handle: clockwise from the right. */
  zero_rad: number;
  /** Reports a second. */
  rate_hz: number | null;
  /** The handle has not moved for half a second. */
  is_still: boolean;
  /** The count belongs to the rig's zero already. */
  is_valid: boolean;
  /** In the step backlash. */
  rocking: RockingState | null;
  can_confirm: boolean;
  /** Why the step cannot be confirmed yet; empty when it can. */
  why: string;
  /** What saving changes of the gears, as `gear_ratio 2.0`; empty: nothing. */
  writes: string;
  can_save: boolean;
  figures: Figure[];
}

/** A picture of the heart from one side. path: to GET from this server; size_px: its width and height. */
export interface HeartView {
  title: string;
  path: string;
  size_px: [number, number];
}

/** One landmark to be touched. places: where it is in each view, as shares of its width and height. */
export interface TouchedLandmark {
  name: string;
  label: string;
  status: "waiting" | "touched" | "skipped";
  places: Vector2[];
  /** Standard deviation of the resting tip (3D); null before it is touched. */
  spread_mm: number | null;
  /** Left by the fit; not a target error. */
  residual_mm: number | null;
  /** Left by a fit to all the others. */
  held_out_mm: number | null;
}

/** The heart being registered by touching landmarks with the tracked tip. */
export interface TouchState {
  type: "calibrate_registration";
  stage: "collecting" | "solving" | "done" | "failed";
  advice: string;
  /** A simulated hand touches the landmarks, without hardware. */
  is_simulated: boolean;
  kind: "rigid" | "similarity" | "affine";
  landmarks: TouchedLandmark[];
  /** The landmark to be touched now; null when none is left. */
  current: string | null;
  views: HeartView[];
  /** Where the tip is in each view, by the landmarks so far; or empty. */
  tip_places: Vector2[];
  is_tracked: boolean;
  /** Why the tip is not tracked; empty when it is. */
  trouble: string;
  /** How much of the rest that it takes the tip has rested by now, 0 to 1. */
  rest_share: number;
  /** Standard deviation of the resting tip (3D). */
  rest_spread_mm: number | null;
  can_take: boolean;
  /** Why the landmark cannot be taken yet; empty when it can. */
  why: string;
  can_finish: boolean;
  can_save: boolean;
  /** What is odd about the landmarks, the gravest first. */
  doubts: string[];
  /** One of the doubts says that the result should not be used. */
  is_grave: boolean;
  figures: Figure[];
  pictures: ResultPicture[];
}

/** One of the three planes, as it is seen. Its slices are at /heart/ct/{name}/{index}.bin. */
export interface SlicePlane {
  name: "axial" | "coronal" | "sagittal";
  columns: number;
  rows: number;
  slices: number;
  /** To the next column, row and slice. */
  spacing_mm: Vector3;
  /** Of the left, right, upper and lower side: R L A P H F. */
  letters: [string, string, string, string];
}

/** A structure that a seed may name, or that the labels show. */
export interface HeartStructure {
  key: string;
  name: string;
  colour: string;
  /** Its value in the slices of the labels; 0: it has none there. */
  label: number;
  /** Whether a seed may name it. */
  seedable: boolean;
  /** In the labels that are shown; null where they do not have it. */
  volume_ml: number | null;
  /** In the labels before these. */
  before_ml: number | null;
}

/** One seed. id: for the commands. */
export interface HeartSeed {
  id: number;
  structure: string;
  /** mm, ct */
  position_mm: Vector3;
  /** Voxels as seen: x to the patient's left, y to the back, z to the feet. */
  seen: Vector3;
  radius_mm: number | null;
  /** Of the voxel it lies in. */
  hu: number;
  /** Key of the structure that the labels have there; empty: none. */
  labelled: string;
}

/** Seeds being placed in a heart's CT. */
export interface HeartSeedsState {
  type: "heart_seeds";
  stage: "ready" | "segmenting" | "failed";
  /** What to do next, or what went wrong: one sentence for a person. */
  advice: string;
  /** Share of the segmentation that is done; null where it is not known. */
  progress: number | null;
  /** What the segmentation does now. */
  doing: string;
  planes: SlicePlane[];
  /** Millimetres in ct of one voxel along x, y, z; and of voxel 0. */
  ct_from_seen: Vector3[];
  /** The largest angle between the slices' axes and the patient's. */
  tilt_deg: number;
  structures: HeartStructure[];
  seeds: HeartSeed[];
  /** For /heart/labels/{version}/{name}/{index}.bin; 0: no labels yet. */
  labels_version: number;
  /** First and last voxel, as seen, of what is labelled; empty: nothing. */
  labels_box: Vector3[];
  labels_from: "nothing" | "file" | "segmentation";
  /** The labels were made with these seeds. */
  is_current: boolean;
  /** What the segmentation could not do, and what helps: sentences. */
  findings: string[];
  can_undo: boolean;
  can_redo: boolean;
  /** The seeds file holds these seeds. */
  saved: boolean;
}

/** Where a viewer's eyes are and where they look: a camera that looks along its own -z, with +y up. */
export interface HeadPose {
  /** mm, box */
  position_mm: Vector3;
  /** box_from_head as a unit quaternion */
  orientation_wxyz: Quaternion;
}

/** Where a headset's wearer has put the scene: scene_from_world, metres, y up; scale 1 is true size. */
export interface WorldPlacement {
  position_m: Vector3;
  orientation_wxyz: Quaternion;
  scale: number;
}

/** One connected client. */
export interface ClientDescription {
  id: string;
  kind: "desktop" | "headset" | "program";
  /** For people, for example Headset 1; it changes when its kind does. */
  name: string;
  role: "viewer" | "operator";
}

/** Everybody who is connected, after every change. Which of them one is says `client` of `hello`. */
export interface ClientsMessage {
  type: "clients";
  clients: ClientDescription[];
}

/** Whom this client follows now; sent as the answer to `follow`, and when the followed one has left. */
export interface FollowingMessage {
  type: "following";
  /** The followed client's id; null: nobody. */
  client: string | null;
  /** Why nobody is followed any more, or cannot be; empty otherwise. */
  sentence: string;
}

/** What the followed client looks at. Newest wins, at most ten a second. */
export interface ViewMessage {
  type: "view";
  /** Whose view it is. */
  client: string;
  /** The scene's settings as that client has them. */
  settings: Record<string, unknown>;
  head: HeadPose | null;
  world: WorldPlacement | null;
}

/** Settings of the scene that are held fast for every client; whoever connects is given it. Empty: none are. */
export interface LockMessage {
  type: "lock";
  /** The settings, by key, with the values that they are held at. */
  values: Record<string, unknown>;
  /** Why, for the person who would like to change them. */
  sentence: string;
}

/** What this client looks at, for those who follow it: to be sent after changes, at most ten times a second. */
export interface ViewReport {
  type: "view";
  kind: "desktop" | "headset";
  /** The scene's settings; the server hands them on as they are. */
  settings: Record<string, unknown>;
  /** Null where there is no view in space. */
  head?: HeadPose | null;
  /** Null on a screen. */
  world?: WorldPlacement | null;
}

/** Asks for another client's views, instead of those asked for before; null: for nobody's. */
export interface Follow {
  type: "follow";
  /** Its id, from `clients`. */
  client: string | null;
}

/** A task that can be trained here. */
export interface TrainingTask {
  key: string;
  name: string;
  /** What to do, in a sentence or two. */
  text: string;
  view: "2d" | "3d" | "free";
  /** Its place in the progression, from 1. */
  step: number | null;
  /** Whether it is familiarisation: offered until its criterion is met. */
  practice: boolean;
  /** Why it cannot be done with this heart and box; empty when it can. */
  problem: string;
}

/** Somebody who is enrolled, by code, and what the study has for them next. */
export interface TrainingParticipant {
  code: string;
  /** In words, for example 2D view, trial 2 of 3; empty outside a study. */
  next: string;
  /** Whether the study has nothing more for them. */
  done: boolean;
}

/** A trial that the program ended under. */
export interface UnfinishedTrial {
  id: string;
  participant: string;
  /** The task's name. */
  task: string;
  /** UTC, ISO 8601. */
  began: string;
  /** What is known of it, and what can be done. */
  sentence: string;
  /** Whether it can be gone on with where its recording ends. */
  can_continue: boolean;
}

/** What can be trained: the newest replaces those before. */
export interface TrainingOffer {
  type: "training_offer";
  /** The study's title; null: training outside a study. */
  study: string | null;
  tasks: TrainingTask[];
  participants: TrainingParticipant[];
  unfinished: UnfinishedTrial[];
}

/** A target of the trial, in the box. */
export interface TrainingTarget {
  key: string;
  name: string;
  /** What must reach it: tip, beam, or the image's plane. */
  kind: "tip" | "beam" | "plane";
  /** mm, box */
  position_mm: Vector3;
  /** How near; of a plane: how near it must pass. */
  radius_mm: number;
  /** How well aligned, where that counts. */
  angle_deg: number | null;
  /** box, unit: where tip or beam must point; of a plane: its normal. */
  direction: Vector3 | null;
  /** box, unit; of a plane: where the beam must point. */
  up: Vector3 | null;
  dwell_s: number;
  state: "later" | "now" | "reached" | "missed";
}

/** The trial at hand. */
export interface TrainingRun {
  id: string;
  participant: string;
  /** The task's key. */
  task: string;
  name: string;
  text: string;
  /** What the participant may see. */
  view: "2d" | "3d" | "free";
  /** The study's condition in words, or the view outside a study. */
  condition: string;
  /** 1, 2, … within participant and condition. */
  number: number;
  practice: boolean;
  limit_s: number;
  /** In the order in which they are offered. */
  targets: TrainingTarget[];
}

/** How a trial stands at the last Track. */
export interface TrainingNow {
  /** The key of the one that is offered. */
  target: string | null;
  number: number;
  /** How many there are; null in practice. */
  of: number | null;
  reached: number;
  in_a_row: number;
  /** Practice ends at so many in a row. */
  wanted_in_a_row: number | null;
  /** Of the dwell, 0 to 1. */
  progress: number;
  distance_mm: number | null;
  angle_deg: number | null;
  up_deg: number | null;
  /** Why nothing counts now, a sentence; empty otherwise. */
  hindrance: string;
  /** Time on task, without pauses. */
  active_s: number;
  remaining_s: number;
  target_remaining_s: number | null;
}

/** One metric of a score card. */
export interface CardLineMessage {
  key: string;
  name: string;
  unit: string;
  better: "lower" | "higher" | "neither";
  value: number | null;
  /** Why there is no value; empty otherwise. */
  reason: string;
  /** (number, value) of own trials so far, this one last. */
  history: [number, number][];
  best_before: number | null;
  is_best: boolean;
  /** Of the other participants' medians; null when there are too few. */
  percentile: number | null;
  others: number;
}

/** The result of the trial at hand. */
export interface TrainingResult {
  outcome: "completed" | "timed_out" | "aborted" | "interrupted";
  /** How it went, in words. */
  sentence: string;
  reached: number;
  of: number;
  active_s: number;
  unseen_share: number;
  /** Why it must not count; empty when it does. */
  invalid: string;
  /** The recording's folder below that of all recordings. */
  recording: string;
  /** Where the numbers were stored, or why they were not, a sentence. */
  stored: string;
  /** Path on the server of the run, to be shown in the scene: `RunPath`. */
  run: string | null;
  lines: CardLineMessage[];
}

/** One item of a survey. */
export interface SurveyItem {
  key: string;
  text: string;
  kind: "rating" | "words";
  minimum: number;
  maximum: number;
  step: number;
  low: string;
  high: string;
  labels: string[];
  optional: boolean;
}

/** A survey that is to be answered now. */
export interface SurveyDescription {
  participant: string;
  survey: string;
  name: string;
  instruction: string;
  source: string;
  occasion: string;
  items: SurveyItem[];
  /** By the item's key: what was answered so far. */
  answers: Record<string, number | string>;
}

/** How training stands: at every change, and at most ten times a second while a trial runs. Newest wins. */
export interface TrainingState {
  type: "training";
  phase: "idle" | "ready" | "countdown" | "running" | "paused" | "ended";
  countdown_s: number | null;
  run: TrainingRun | null;
  now: TrainingNow | null;
  result: TrainingResult | null;
  survey: SurveyDescription | null;
  /** What the operator should know; empty otherwise. */
  sentence: string;
  /** The commands of training that would be carried out now. */
  can: string[];
}

/** A run, to be shown in the scene again: what `TrainingResult.run` leads to, as JSON, 20 samples a second. */
export interface RunPath {
  id: string;
  participant: string;
  task: string;
  /** s since the trial began; pauses are left out. */
  t: number[];
  /** mm, box; null where it was not tracked. */
  tip: (Vector3 | null)[];
  /** box, unit; null where the roll was not known. */
  beam: (Vector3 | null)[];
  /** Some 12 points of the catheter, tip first, mm, box. */
  shape: (Vector3[] | null)[];
  targets: TrainingTarget[];
  /** (target, s since the trial began) */
  reached: [string, number][];
}

/** One check of the set-up: what was looked at, what was found, what to do. */
export interface SetupCheckState {
  subject: "cameras" | "which" | "light" | "focus" | "markers" | "encoder" | "network" | "headset" | "rig";
  title: string;
  /** warn: not needed for everything; unknown: what is there now does not tell. */
  verdict: "good" | "warn" | "wrong" | "unknown";
  /** What was measured. */
  found: string;
  /** What to do; may be empty. */
  then: string;
  /** The camera that it is about; empty: no single one. */
  camera: "" | "top" | "front";
  /** When it was measured, seconds of the host's monotonic clock; null: as of this message. */
  t: number | null;
}

/**
 * How the set-up stands. Sent when an operator's command `setup_check` asks for it; the newest wins.
 *
 * `setup_check` takes `{pictures, said}`. pictures (true): look at new pictures too, else only at what is known at
 * once. said: "right" or "swapped", what a person saw of which camera is which.
 */
export interface SetupState {
  type: "setup";
  /** Seconds of the host's monotonic clock. */
  t: number;
  /** Pictures are being looked at: another state follows. */
  busy: boolean;
  checks: SetupCheckState[];
}

/** How some measured times are spread, ms; over: how many were longer than one and a half times the median. */
export interface Spread {
  count: number;
  median: number;
  p95: number;
  p99: number;
  longest: number;
  over: number;
}

/** Frames of a session in a headset. */
export interface HeadsetFrames {
  mode: "vr" | "ar";
  seconds: number;
  /** What the headset said its rate is; null: it did not say. */
  rate_hz: number | null;
  intervals_ms: Spread;
  /** JavaScript for each frame; null where it was not measured. */
  script_ms: Spread | null;
}

/** The link between the device and the server. */
export interface DiagLink {
  connected: boolean;
  round_trip_ms: Spread | null;
  /** From mid-exposure to the page; null in a replay. */
  track_age_ms: Spread | null;
  track_interval_ms: Spread | null;
  /** Tracks that newer ones replaced on the way. */
  skipped: number;
}

/** What the graphics offer. Sizes in pixels or voxels; empty names: the browser does not say. */
export interface DiagGraphics {
  webgl2: boolean;
  vendor: string;
  renderer: string;
  version: string;
  max_texture: number;
  max_texture_3d: number;
  max_samples: number;
  max_uniform_vectors: number;
  extensions: string[];
}

/** The browser and what it runs on. */
export interface DiagDevice {
  user_agent: string;
  /** Whether the page has a secure address, which WebXR needs. */
  secure: boolean;
  webxr: boolean;
  vr: boolean;
  ar: boolean;
  screen_px: [number, number];
  pixel_ratio: number;
  cores: number;
  memory_gb: number | null;
  touch_points: number;
}

/** One measurement, as `POST /diag` takes it. */
export interface DiagReport {
  schema: "cathxr-diag/1";
  /** What the server's hello said. */
  software: string;
  /** How long was measured. */
  seconds: number;
  device: DiagDevice;
  graphics: DiagGraphics;
  /** Between the page's frames. */
  frames_ms: Spread | null;
  /** For a test picture, from asking to having it. */
  draw_ms: Spread | null;
  link: DiagLink;
  /** The last session in a headset on this device. */
  headset: HeadsetFrames | null;
}

/** First message on every link. */
export interface Hello {
  type: "hello";
  /** Protocol version of the server. */
  protocol: number;
  /** Name and version of the server. */
  software: string;
  /** Each frame's axes and origin, in words. */
  frames: Record<string, string>;
  /** Unit of each kind of quantity. */
  units: Record<string, string>;
  /** What this client may do now: an operator may command. */
  role: "viewer" | "operator";
  /** What feeds the tracker: twin, cameras, or replay. */
  source: string;
  /** Whether a pairing code turns this viewer into an operator. */
  needs_pairing: boolean;
  /** This client's id among `clients`. */
  client: string;
}

/** The tip's pose in `box`. */
export interface TipState {
  /** mm, box */
  position: Vector3;
  /** box_from_tip as a unit quaternion */
  orientation_wxyz: Quaternion;
}

/** The catheter at one instant. When lost, points, tip, roll, yaw, pitch and sigma_mm are null. */
export interface TrackMessage {
  type: "track";
  /** 0-based index of the picture pair. */
  seq: number;
  /** Mid-exposure of the top picture, seconds of the host's monotonic clock. */
  t: number;
  status: "tracked" | "coasting" | "lost";
  /** Why it is not tracked; empty when tracked. */
  reason: string;
  /** K points, mm, box, tip first, uniform in arc length. */
  points: Vector3[] | null;
  tip: TipState | null;
  /** Unwrapped roll, rad; null where it is not valid (message `roll` says why). */
  roll: number | null;
  /** Whether it is carried on beyond the encoder's last reading. */
  roll_predicted: boolean;
  /** atan2(dy, dx) of the tip's tangent in box, rad. */
  yaw: number | null;
  /** asin(dz) of the tip's tangent in box, rad. */
  pitch: number | null;
  /** Root of the trace of the tip's covariance, calibration included. */
  sigma_mm: number | null;
  /** Mid-exposure to Track, ms; null in a replay. */
  latency_ms: number | null;
}

/**
 * Whether the roll is valid, and what to do where it is not. Newest wins; whoever connects is given it.
 *
 * Without a valid roll every Track's `roll` is null, its tip's orientation takes roll as 0, and a client shows no
 * beam. A system that has no encoder, or plays a recording, may never send it.
 */
export interface RollState {
  type: "roll";
  /** Whether an encoder is connected. */
  present: boolean;
  /** Whether its count gives the roll. */
  valid: boolean;
  /** What an operator has to do: command roll_confirm, or set roll zero with the jig, then roll_zero. */
  needs: "" | "confirm" | "jig";
  /** Why it is not valid and what to do; empty when valid or without an encoder. */
  sentence: string;
  /** Whether a Track since the last of these messages had a predicted roll. */
  predicted: boolean;
}

/**
 * Something that happened.
 *
 * Kind `done` goes only to the client whose command was carried out: its payload is `{id, name, result}`; the result
 * of `pair` is `{role: "operator"}`.
 */
export interface EventMessage {
  type: "event";
  /** Seconds of the host's monotonic clock. */
  t: number;
  kind: string;
  payload: Record<string, unknown>;
}

/** One source's state. */
export interface SourceHealth {
  source: string;
  running: boolean;
  /** Since its last item; null before the first. */
  age_s: number | null;
  rate_hz: number;
  /** Items dropped or skipped so far. */
  losses: number;
  last_error: string | null;
}

/** State of every source, about once a second. */
export interface HealthMessage {
  type: "health";
  t: number;
  sources: SourceHealth[];
  /** Front picture's instant minus the top's, latest pair. */
  skew_ms: number | null;
  /** Clients connected. */
  clients: number;
  /** Messages this client did not get because newer ones had come. */
  skipped: number;
}

/** State of the recording and of the source. */
export interface SessionMessage {
  type: "session";
  recording: boolean;
  /** Folder name of the recording in progress. */
  name: string | null;
  /** Length of the recording so far. */
  seconds: number;
}

/** Answer to a ping: lets a client estimate the host's clock. */
export interface Pong {
  type: "pong";
  /** The ping's own t, echoed. */
  client_t: number;
  /** Seconds of the host's monotonic clock at the answer. */
  t: number;
}

/** Why something was refused, in a sentence for a person. */
export interface Refusal {
  type: "refusal";
  code: "protocol" | "message" | "role" | "pairing" | "command" | "busy";
  sentence: string;
  /** The refused command's id, if it had one. */
  id: string | null;
}

/** Asks for something; only operators may, except `pair`. Answered by an event `done` or a refusal, with its id. */
export interface Command {
  type: "command";
  /** pair, steer, reset_tracker, record_start, roll_confirm, … */
  name: string;
  args?: Record<string, unknown>;
  id?: string | null;
}

/** Heartbeat and clock probe. */
export interface Ping {
  type: "ping";
  /** The client's own clock, echoed in the pong. */
  t: number;
}

/** Says that a track was handled: narrows the window of messages in flight. */
export interface Ack {
  type: "ack";
  seq: number;
}

/** A rigid transform. */
export interface PoseDescription {
  rotation_wxyz: Quaternion;
  translation_mm: Vector3;
}

/** One camera of the rig: OpenCV pinhole, distortion k1 k2 p1 p2 k3. */
export interface CameraDescription {
  name: string;
  size_px: [number, number];
  rate_hz: number;
  focal_px: Vector2;
  centre_px: Vector2;
  distortion: [number, number, number, number, number];
  camera_from_box: PoseDescription;
}

/** One named surface in heart.glb. */
export interface PartDescription {
  name: string;
  label: string;
  node: string;
  colour: string;
  /** How it is best shown from outside, 0 to 1. */
  opacity: number;
}

/**
 * Where the heart is: point_ct = scale * R * point_box + t, or, where it is given, linear * point_box + t.
 *
 * The error fields are null when unknown. An affinity's scale and rotation are those nearest to its linear part: an
 * orientation is turned by them.
 */
export interface RegistrationDescription {
  /** placement (nothing was measured), rigid, similarity or affine. */
  kind: string;
  ct_from_box: PoseDescription;
  scale: number;
  /** Row by row; scale, stretch and rotation in one. Null unless kind is affine. */
  linear: [Vector3, Vector3, Vector3] | null;
  /** Root mean square residual of the landmarks; not the error elsewhere. */
  fre_mm: number | null;
  /** Held-out (leave-one-out) error, root mean square. */
  tre_mm: number | null;
  /** Expected error at the landmarks' centroid. */
  predicted_tre_mm: number | null;
  /** Greatest expected error over the heart. */
  worst_tre_mm: number | null;
  /** ISO date of the measurement. */
  date: string | null;
}

/**
 * How a channel's byte gives a value; c is the byte / 255.
 *
 * square: value = high * c^2. asinh: value = centre * exp(width * sinh(low + c * (high - low))).
 */
export interface ScaleDescription {
  curve: "square" | "asinh";
  unit: string;
  high: number;
  low: number;
  centre: number;
  width: number;
}

/** The acoustic volume: RGBA of a byte each at every voxel, i fastest, for a 3D texture. */
export interface AcousticDescription {
  /** 4 * i * j * k bytes; goes over the link as gzip where the client takes that. */
  file: string;
  /** Voxels along i, j, k. */
  size: [number, number, number];
  /** Row by row: (i, j, k, 1) of a voxel's centre to mm in ct. */
  ct_from_voxel: Matrix4;
  /** Channel R. */
  impedance: ScaleDescription;
  /** Channel G. */
  scatter: ScaleDescription;
  /** Channel B. */
  attenuation: ScaleDescription;
  /** Channel A. */
  interface: ScaleDescription;
}

/** What a value of the label volume means. */
export interface LabelDescription {
  value: number;
  /** The part's key. */
  name: string;
  /** Its name for people. */
  label: string;
  colour: string;
  /** Whether it is blood, where a catheter may be; else it is a wall. */
  is_blood: boolean;
}

/** The label volume: a byte at every voxel, i fastest, 0 for nothing; nothing all around its outside. */
export interface LabelsDescription {
  /** i * j * k bytes; goes over the link as gzip where the client takes that. */
  file: string;
  /** Voxels along i, j, k; at most 192. */
  size: [number, number, number];
  /** Row by row: (i, j, k, 1) of a voxel's centre to mm in ct. */
  ct_from_voxel: Matrix4;
  values: LabelDescription[];
}

/** A named place of the heart, whether or not the box's region holds it. Diameter and structure: openings only. */
export interface LandmarkDescription {
  name: string;
  /** Its name for people. */
  label: string;
  kind: "opening" | "landmark";
  /** mm, ct */
  position_ct: Vector3;
  /** Unit vector, ct, out of the structure that it is an opening of. */
  normal_ct: Vector3 | null;
  diameter_mm: number | null;
  /** The part that it is an opening of. */
  structure: string | null;
}

/** The heart: its files, parts, and attribution. glTF: metres, y up, (x, z, -y) / 1000 of ct. */
export interface HeartDescription {
  glb: string;
  parts: PartDescription[];
  attribution: string;
  registration: RegistrationDescription;
  acoustic: AcousticDescription | null;
  labels: LabelsDescription | null;
  landmarks: LandmarkDescription[];
}

/** A place to reach: an opening or a landmark that lies in the box's region. */
export interface TargetDescription {
  name: string;
  /** mm, box */
  position_mm: Vector3;
  radius_mm: number;
  /** Its name for people. */
  label: string;
  /** Unit vector, box, out of what it is an opening of. */
  normal: Vector3 | null;
  /** Of the circle of the opening's area. */
  diameter_mm: number | null;
}

/** What the twin lets an operator steer: (min, max) of each control, and the scripted manoeuvres. */
export interface TwinDescription {
  insertion_mm: Vector2;
  roll_deg: Vector2;
  anterior_deg: Vector2;
  left_deg: Vector2;
  manoeuvres: string[];
}

/** Everything that does not change while the server runs. */
export interface SceneDescription {
  protocol: number;
  source: string;
  frames: Record<string, string>;
  roi_min_mm: Vector3;
  roi_max_mm: Vector3;
  catheter_name: string;
  catheter_diameter_mm: number;
  sector_deg: number | null;
  cameras: CameraDescription[];
  heart: HeartDescription | null;
  targets: TargetDescription[];
  twin: TwinDescription | null;
}

/** What the server sends. */
export type ServerMessage =
  | Hello
  | TrackMessage
  | EventMessage
  | HealthMessage
  | SessionMessage
  | RollState
  | Pong
  | Refusal
  | IntrinsicsState
  | MarkersState
  | CamerasState
  | RollCalibrationState
  | TouchState
  | HeartSeedsState
  | ClientsMessage
  | FollowingMessage
  | ViewMessage
  | LockMessage
  | TrainingOffer
  | TrainingState
  | SetupState;

/** What a client sends. */
export type ClientMessage =
  | Command
  | Ping
  | Ack
  | ViewReport
  | Follow;
