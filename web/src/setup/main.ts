/** Starts the page that walks through the set-up. */

import "../styles/base.css";
import "../styles/shell.css";
import "../styles/parts.css";
import "../styles/setup.css";
import { countErrors } from "../debug";
import { settingsFrom } from "../settings";
import { tellStartFailure } from "../ui/banner";
import { SetupPage } from "./page";

const errors = countErrors();

try {
  const page = new SetupPage(settingsFrom(location.search).picturesHz, errors);
  window.__cathxrSetup = page.handle();
  page.start();
} catch (error) {
  tellStartFailure(error, "It needs a browser of the last few years: update the browser, or try another one.");
}
