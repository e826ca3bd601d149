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
