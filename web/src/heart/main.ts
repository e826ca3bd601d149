/** Starts the page on which a heart's seeds are placed. */

import "../styles/base.css";
import "../styles/shell.css";
import "../styles/parts.css";
import "../styles/calibrate.css";
import "../styles/heart.css";
import { countErrors } from "../debug";
import { tellStartFailure } from "../ui/banner";
import { SeedsPage } from "./page";

const errors = countErrors();

try {
  const page = new SeedsPage(errors);
  window.__cathxrSeeds = page.handle();
  page.start();
} catch (error) {
  tellStartFailure(error, "It needs a browser of the last few years: update the browser, or try another one.");
}
