/** Status and messages over the 3D view. */

import { byId, setText } from "./dom";
import type { Condition } from "./condition";

export class Stage {
  private readonly status = byId("status");
  private readonly banner = byId("banner");
  private readonly title = byId("banner-title");
  private readonly detail = byId("banner-detail");
  private readonly hint = byId("banner-hint");
  private readonly retry = byId<HTMLButtonElement>("banner-retry");
  private readonly stage = byId("view").parentElement!;

  constructor(onRetry: () => void) {
    this.retry.addEventListener("click", onRetry);
  }

  show(condition: Condition): void {
    setText(this.status, condition.label);
    this.status.dataset["level"] = condition.level;
    this.stage.dataset["stale"] = String(condition.stale);
    const { banner } = condition;
    this.banner.hidden = banner === null;
    if (banner === null) return;
    this.banner.dataset["level"] = banner.level;
    setText(this.title, banner.title);
    setText(this.detail, banner.detail);
    setText(this.hint, banner.hint);
    this.retry.hidden = !banner.retry;
  }
}
