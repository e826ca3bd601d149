/** Starts the page. */

import "./styles/base.css";
import "./styles/shell.css";
import "./styles/layout.css";
import "./styles/parts.css";
import "./styles/flat.css";
import "./styles/scene.css";
import "./styles/readout.css";
import "./styles/guide.css";
import "./styles/training.css";
import { App } from "./app";
import { countErrors } from "./debug";
import { settingsFrom } from "./settings";
import { hasWebGl2, tellNoGraphics, tellStartFailure } from "./ui/banner";

const errors = countErrors();

async function start(): Promise<void> {
  if (new URLSearchParams(location.search).get("xr") === "emulate") (await import("./xr/emulate")).emulateHeadset();
  const app = new App(settingsFrom(location.search), errors);
  window.__cathxr = app.debugHandle();
  app.start();
}

start().catch((error: unknown) => {
  if (hasWebGl2()) tellStartFailure(error, "Load the page again. What this device can do is measured at /diag.");
  else tellNoGraphics();
});
