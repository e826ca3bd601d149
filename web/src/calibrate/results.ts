/** A calibration's figures and result pictures, and one picture enlarged. */

import type { Figure, ResultPicture } from "../generated/messages";
import { byId, make, setText } from "../ui/dom";
import { keyed } from "./keyed";

const MARKS: Record<Figure["level"], string> = { plain: "", good: "✓", warn: "!", bad: "✕" };
const LEVELS: Record<Figure["level"], string> = { plain: "", good: "good", warn: "fair", bad: "bad" };

/** Makes a list `dl` show figures: label, value with its unit, and how good it is, as sign, word and colour. */
export function showFigures(host: HTMLElement, figures: readonly Figure[]): void {
  keyed(host, figures.map((figure, index) => ({ ...figure, key: `${index} ${figure.label}` })), (each) => each.key,
    () => {
      const row = make("div");
      const value = make("dd");
      value.append(make("b"), make("i", "mark"));
      row.append(make("dt"), value);
      return row;
    },
    (row, figure) => {
      row.dataset["level"] = figure.level;
      setText(row.querySelector("dt")!, figure.label);
      setText(row.querySelector("b")!, figure.value);
      const mark = row.querySelector<HTMLElement>(".mark")!;
      setText(mark, MARKS[figure.level]);
      mark.hidden = figure.level === "plain";
      mark.title = LEVELS[figure.level];
      mark.setAttribute("role", "img");
      mark.setAttribute("aria-label", LEVELS[figure.level]);
    });
}

export class ResultPictures {
  private readonly dialog = byId<HTMLDialogElement>("enlarged");
  private readonly image = byId<HTMLImageElement>("enlarged-image");
  private readonly title = byId("enlarged-title");
  private version = 0;
  private shown = "";

  constructor(private readonly host: HTMLElement) {
    this.dialog.addEventListener("click", (event) => {
      if (event.target === this.dialog || event.target === this.image) this.dialog.close();
    });
  }

  /** Shows pictures; `fresh`: they have been made anew under the same names. */
  show(pictures: readonly ResultPicture[], fresh: boolean): void {
    if (fresh) this.version += 1;
    const now = JSON.stringify([this.version, pictures]);
    if (now === this.shown) return;
    this.shown = now;
    this.host.hidden = pictures.length === 0;
    keyed(this.host, pictures, (picture) => picture.path, () => {
      const button = make("button", "result");
      button.type = "button";
      const image = make("img");
      image.decoding = "async";
      button.append(image, make("span"));
      button.addEventListener("click", () => this.enlarge(button));
      return button;
    }, (button, picture) => {
      const image = button.querySelector("img")!;
      image.src = this.address(picture.path);
      image.alt = "";
      button.setAttribute("aria-label", `${picture.title}: enlarge`);
      setText(button.querySelector("span")!, picture.title);
    });
  }

  private address(path: string): string {
    const address = new URL(path.replace(/^\//, ""), document.baseURI);
    address.searchParams.set("v", String(this.version));
    return address.href;
  }

  private enlarge(button: HTMLButtonElement): void {
    const title = button.querySelector("span")!.textContent ?? "";
    this.image.src = button.querySelector("img")!.src;
    this.image.alt = title;
    setText(this.title, title);
    this.dialog.showModal();
  }
}
