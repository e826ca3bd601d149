/** Status and messages over the 3D view. */

import { BannerView } from "./banner";
import { byId, setText } from "./dom";
import type { Condition } from "./condition";

export class Stage {
  private readonly status = byId("status");
  private readonly banner: BannerView;
  private readonly stage = byId("view").parentElement!;

  constructor(onRetry: () => void) {
    this.banner = new BannerView(onRetry);
  }

  show(condition: Condition): void {
    setText(this.status, condition.label);
    this.status.dataset["level"] = condition.level;
    this.stage.dataset["stale"] = String(condition.stale);
    this.banner.show(condition.banner);
  }
}
