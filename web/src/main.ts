/** Starts the page. */

import "./styles/base.css";
import "./styles/layout.css";
import "./styles/parts.css";
import { App } from "./app";
import { countErrors } from "./debug";
import { settingsFrom } from "./settings";
import { byId } from "./ui/dom";

const errors = countErrors();

function start(): void {
  const app = new App(settingsFrom(location.search), errors);
  window.__cathxr = app.debugHandle();
  app.start();
}

try {
  start();
} catch (error) {
  const banner = byId("banner");
  banner.hidden = false;
  banner.dataset["level"] = "bad";
  byId("banner-title").textContent = "The page cannot start";
  byId("banner-detail").textContent = error instanceof Error ? error.message : String(error);
  byId("banner-hint").textContent = "It needs a browser with WebGL 2: update the browser, or turn its graphics acceleration on.";
}
