/** Starts the calibration page. */

import "../styles/base.css";
import "../styles/shell.css";
import "../styles/parts.css";
import "../styles/calibrate.css";
import "../styles/roll.css";
import "../styles/touch.css";
import { countErrors } from "../debug";
import { settingsFrom } from "../settings";
import { tellStartFailure } from "../ui/banner";
import { CalibrationPage } from "./page";

const errors = countErrors();

try {
  const page = new CalibrationPage(settingsFrom(location.search).picturesHz, errors);
  window.__cathxrCalibration = page.handle();
  page.start();
} catch (error) {
  tellStartFailure(error, "It needs a browser of the last few years: update the browser, or try another one.");
}
