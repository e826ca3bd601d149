/** Which buttons a calibration offers now, and why one of them cannot be pressed. */

import type { CamerasState, IntrinsicsState, MarkersState, RollCalibrationState, TouchState } from "../generated/messages";

export type Calibration = IntrinsicsState | MarkersState | CamerasState | RollCalibrationState | TouchState;

export interface Offer {
  readonly command: string;
  readonly label: string;
  readonly kind: "primary" | "plain" | "quiet";
  /** Why it cannot be pressed now; empty: it can. */
  readonly why: string;
  /** Asked before it is done; empty: nothing is asked. */
  readonly confirm: string;
}

/** Fewer views than this determine nothing; the server has the last word. */
const LEAST_VIEWS = 3;

/** Returns the offers for a state, the most important first. `viewing`: why this page may not command, or empty. */
export function offersFor(state: Calibration, viewing: string): Offer[] {
  const offers = state.type === "calibrate_intrinsics" ? lensOffers(state)
    : state.type === "calibrate_markers" ? markerOffers(state)
    : state.type === "calibrate_roll" ? rollOffers(state)
    : state.type === "calibrate_registration" ? touchOffers(state)
    : cameraOffers(state);
  const nothing = (state.type === "calibrate_intrinsics" && state.kept === 0) || (state.type === "calibrate_roll" && state.step === "zero")
    || (state.type === "calibrate_registration" && state.landmarks.every((each) => each.status !== "touched"));
  offers.push(offer("calibration_cancel", "Cancel", "quiet", "", nothing ? "" : CANCEL[state.type]));
  return viewing === "" ? offers : offers.map((each) => ({ ...each, why: viewing }));
}

const CANCEL: Record<Calibration["type"], string> = {
  calibrate_intrinsics: "The views that were kept are lost, and the rig stays as it is.",
  calibrate_markers: "The markers that were placed are lost, and the rig stays as it is.",
  calibrate_roll: "What was measured is lost; the rig and the board's zero stay as they are.",
  calibrate_registration: "The landmarks that were touched are lost, and the heart's registration stays as it is.",
  calibrate_cameras: "Nothing is saved: the configuration stays as it is.",
};

function lensOffers(state: IntrinsicsState): Offer[] {
  switch (state.stage) {
    case "collecting": {
      const enough = state.kept >= state.wanted;
      const finish = offer("calibration_finish", "Finish", enough ? "primary" : "plain",
        state.kept < LEAST_VIEWS ? "Finish: views of the board are needed first." : "");
      const capture = offer("calibration_capture", "Capture now", enough ? "plain" : "primary",
        state.corners_px.length === 0 ? "Capture now: there is no board in the picture." : "");
      return enough ? [finish, capture] : [capture, finish];
    }
    case "solving":
      return [];
    case "done":
      return [
        offer("calibration_accept", "Accept and write the rig", "primary"),
        offer("calibration_continue", "Collect more", "plain"),
      ];
    case "failed":
      return [offer("calibration_continue", "Collect more", "primary")];
  }
}

/** Each marker that is placed is solved for at once: the offer stays where it is meanwhile. */
function markerOffers(state: MarkersState): Offer[] {
  const why = state.stage === "solving" ? "Accept: being calculated." : state.can_save ? "" : "Accept: markers are missing.";
  return [offer("calibration_accept", "Accept and write the rig", "primary", why)];
}

function cameraOffers(state: CamerasState): Offer[] {
  if (state.stage === "solving") return [];
  const locked = state.stage === "done";
  const chosen = state.devices.some((device) => device.role !== "");
  return [
    offer("calibration_accept", "Save", "primary", state.can_save ? "" : "Save: say first which device is top and which is front."),
    locked
      ? offer("calibration_continue", "Back to automatic", "plain")
      : offer("calibration_finish", "Lock settings", "plain", chosen ? "" : "Lock settings: choose the cameras first."),
  ];
}

/** What saving changes of the gears stands on the button: pressing it is the person's word for that. */
function rollOffers(state: RollCalibrationState): Offer[] {
  switch (state.stage) {
    case "collecting": {
      const confirm = offer("calibration_confirm", CONFIRM[state.step], "primary", state.can_confirm ? "" : state.why);
      return state.step === "zero" ? [confirm] : [confirm, offer("calibration_repeat", "Repeat this step", "plain")];
    }
    case "solving":
      return [];
    case "done": {
      const save = state.writes === "" ? "Save zero and backlash" : `Write ${state.writes} and save`;
      const why = !state.can_save ? state.why : state.is_still ? "" : "The handle is moving: lock it and let go.";
      return [offer("calibration_accept", save, "primary", why), offer("calibration_repeat", "Begin again", "plain")];
    }
    case "failed":
      return [offer("calibration_repeat", "Begin again", "primary")];
  }
}

const CONFIRM: Record<RollCalibrationState["step"], string> = {
  zero: "T is in the jig, locked", backlash: "Rocked enough", turn: "One turn done, locked", review: "",
};

function touchOffers(state: TouchState): Offer[] {
  switch (state.stage) {
    case "collecting": {
      const finish = (kind: Offer["kind"]): Offer => offer("calibration_finish", "Finish", kind,
        state.can_finish ? "" : "Finish: more landmarks are needed first.");
      if (state.current === null) return [finish("primary")];
      return [
        offer("registration_take", "Take this place", "primary", state.can_take ? "" : state.why),
        offer("registration_skip", "Skip it", "plain"),
        ...(state.can_finish ? [finish("plain")] : []),
      ];
    }
    case "solving":
      return [];
    case "done": {
      const back = offer("calibration_continue", "Back to touching", state.is_grave ? "primary" : "plain");
      const save = offer("calibration_accept", state.is_grave ? "Save in spite of doubts" : "Save the registration",
        state.is_grave ? "plain" : "primary", state.can_save ? "" : "It is being worked out.");
      return state.is_grave ? [back, save] : [save, back];
    }
    case "failed":
      return [offer("calibration_continue", "Back to touching", "primary")];
  }
}

function offer(command: string, label: string, kind: Offer["kind"], why = "", confirm = ""): Offer {
  return { command, label, kind, why, confirm };
}
