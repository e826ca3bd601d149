/** Starts the page. */

import "./styles/base.css";
import "./styles/shell.css";
import "./styles/layout.css";
import "./styles/parts.css";
import { App } from "./app";
import { countErrors } from "./debug";
import { settingsFrom } from "./settings";
import { tellStartFailure } from "./ui/banner";

const errors = countErrors();

function start(): void {
  const app = new App(settingsFrom(location.search), errors);
  window.__cathxr = app.debugHandle();
  app.start();
}

try {
  start();
} catch (error) {
  tellStartFailure(error, "It needs a browser with WebGL 2: update the browser, or turn its graphics acceleration on.");
}
