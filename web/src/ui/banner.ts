/** The banner over the page's main part: one trouble at a time. */

import type { Banner } from "./condition";
import { byId, setText } from "./dom";

export class BannerView {
  private readonly banner = byId("banner");
  private readonly title = byId("banner-title");
  private readonly detail = byId("banner-detail");
  private readonly hint = byId("banner-hint");
  private readonly retry = byId<HTMLButtonElement>("banner-retry");

  constructor(onRetry: () => void) {
    this.retry.addEventListener("click", onRetry);
  }

  show(banner: Banner | null): void {
    this.banner.hidden = banner === null;
    if (banner === null) return;
    this.banner.dataset["level"] = banner.level;
    setText(this.title, banner.title);
    setText(this.detail, banner.detail);
    setText(this.hint, banner.hint);
    this.retry.hidden = !banner.retry;
  }
}

/** Says that the page's program cannot start. */
export function tellStartFailure(error: unknown, hint: string): void {
  new BannerView(() => location.reload()).show({
    level: "bad",
    title: "The page cannot start",
    detail: error instanceof Error ? error.message : String(error),
    hint,
    retry: false,
  });
}

/** Returns whether this browser gives a page the graphics that the scene is drawn with. */
export function hasWebGl2(): boolean {
  return document.createElement("canvas").getContext("webgl2") !== null;
}

/** Says that the scene cannot be drawn here, and where to find out why. */
export function tellNoGraphics(): void {
  new BannerView(() => location.reload()).show({
    level: "bad",
    title: "This browser cannot draw the scene",
    detail: "It offers no WebGL 2. Update the browser, turn its graphics (hardware) acceleration on, or use another device.",
    hint: "",
    retry: true,
  });
  const link = byId<HTMLAnchorElement>("banner-link");
  link.href = new URL("diag", document.baseURI).href;
  link.textContent = "See what this device offers";
  link.hidden = false;
  setText(byId("status"), "no graphics");
  byId("status").dataset["level"] = "bad";
}
