/** Devices being told apart: a card for each with its live picture, and what a person says it is. */

import type { CamerasState, DeviceState } from "../generated/messages";
import { byId, make, setText } from "../ui/dom";
import { toast } from "../ui/toasts";
import { keyed } from "./keyed";
import { LivePicture } from "./live_picture";
import { showFigures } from "./results";
import type { Call, View, ViewContext } from "./view";

const ROLES = [["top", "Top"], ["front", "Front"], ["", "Neither"]] as const;
const CARD_HZ = 10;

export class CamerasView implements View<CamerasState> {
  private readonly area = byId("devices");
  private readonly pictures = new Map<string, LivePicture>();
  private state: CamerasState | null = null;
  private operating = false;
  private linked = false;

  constructor(private readonly context: ViewContext) {}

  title(): string {
    return "Which camera is which";
  }

  take(state: CamerasState): void {
    this.state = state;
    this.area.hidden = false;
    keyed(this.area, state.devices, (device) => device.key, (device) => this.makeCard(device), (card, device) => this.fill(card, device));
    for (const [key, picture] of this.pictures) {
      if (state.devices.some((device) => device.key === key)) continue;
      picture.close();
      this.pictures.delete(key);
    }
    this.allow(this.operating, this.linked);
  }

  call(state: CamerasState): Call {
    const open = ["top", "front"].filter((role) => !state.devices.some((device) => device.role === role));
    const word = {
      collecting: open.length === 0 ? "Both chosen" : open.length === 1 ? `Which one is the ${open[0]} camera?` : "Which camera is which?",
      solving: "Locking the settings",
      done: "Settings locked",
      failed: "Not yet",
    }[state.stage];
    return { look: state.stage === "collecting" ? (open.length === 0 ? "known" : "wanted") : state.stage, word };
  }

  allow(operating: boolean, linked: boolean): void {
    const broke = this.linked && !linked;
    this.operating = operating;
    this.linked = linked;
    for (const [key, picture] of this.pictures) {
      const trouble = this.state?.devices.find((device) => device.key === key)?.trouble ?? "";
      picture.setActive(linked && !document.hidden && trouble === "");
      if (trouble !== "") picture.tell("no picture");
      else if (broke) picture.tell("no link");
    }
    const busy = this.state?.stage === "solving";
    for (const button of this.area.querySelectorAll("button")) button.disabled = !operating || busy;
  }

  tick(): void {
    // cards change with states only
  }

  hide(): void {
    for (const picture of this.pictures.values()) picture.close();
    this.pictures.clear();
    this.area.replaceChildren();
    this.area.hidden = true;
    this.state = null;
  }

  shown(): Record<string, number> {
    return Object.fromEntries([...this.pictures].map(([key, picture]) => [key, picture.shownSeq]));
  }

  private makeCard(device: DeviceState): HTMLElement {
    const card = make("article", "card");
    const shot = make("div", "shot");
    const canvas = make("canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `Live picture of ${device.label}`);
    const note = make("span", "note");
    shot.append(canvas, note);
    const picture = new LivePicture({
      camera: device.key, canvas, note, picturesHz: Math.min(CARD_HZ, this.context.picturesHz), full: false,
      overlay: ({ bitmap }) => {
        if (bitmap !== null) picture.describe({ width: bitmap.width, height: bitmap.height });
      },
    });
    this.pictures.set(device.key, picture);
    const head = make("div", "head");
    head.append(make("h3"), make("span", "faint device"), make("span", "badge"));
    const roles = make("div", "roles");
    roles.setAttribute("role", "group");
    roles.setAttribute("aria-label", `What ${device.label} is`);
    for (const [role, words] of ROLES) {
      const button = make("button", "", words);
      button.type = "button";
      button.dataset["role"] = role;
      button.addEventListener("click", () => void this.assign(device.key, role));
      roles.append(button);
    }
    card.append(shot, head, make("p", "trouble"), roles, make("dl", "pairs figures-list"));
    return card;
  }

  private fill(card: HTMLElement, device: DeviceState): void {
    card.dataset["role"] = device.role;
    setText(card.querySelector("h3")!, device.label);
    setText(card.querySelector(".device")!, `device ${device.device}`);
    const badge = card.querySelector<HTMLElement>(".badge")!;
    badge.hidden = device.suggestion === "";
    setText(badge, `fiducials say: ${device.suggestion}`);
    const trouble = card.querySelector<HTMLElement>(".trouble")!;
    trouble.hidden = device.trouble === "";
    setText(trouble, device.trouble);
    for (const button of card.querySelectorAll<HTMLButtonElement>(".roles button")) {
      const role = button.dataset["role"];
      button.setAttribute("aria-pressed", String(role === device.role));
      button.classList.toggle("suggested", role !== "" && role === device.suggestion && device.role === "");
    }
    showFigures(card.querySelector("dl")!, device.settings);
  }

  private async assign(key: string, role: DeviceState["role"]): Promise<void> {
    const answer = await this.context.ask("calibration_assign", { key, role });
    if (!answer.done) toast(answer.sentence, "bad");
  }
}
