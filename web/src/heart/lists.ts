/** The side's lists: structures to choose from, seeds that are placed, what the segmentation found. */

import { keyed } from "../calibrate/keyed";
import type { HeartSeed, HeartStructure } from "../generated/messages";
import { fixed, sentence } from "../maths/format";
import { byId, make, setText } from "../ui/dom";
import { placeText } from "./geometry";
import type { SeedsModel } from "./model";

const NOTHING = "";
/** A change of volume this small is not worth telling. */
const LEAST_CHANGE_ML = 0.05;

export interface ListHandlers {
  onChoose(structure: string | null): void;
  onSelect(seed: HeartSeed): void;
  onRemove(seed: HeartSeed): void;
  onHide(structure: string, hidden: boolean): void;
}

export class Lists {
  private readonly structures = byId("structures");
  private readonly seeds = byId("seeds");

  constructor(private readonly model: SeedsModel, private readonly handlers: ListHandlers) {}

  refresh(operating: boolean): void {
    this.showStructures(operating);
    this.showSeeds(operating);
    const findings = this.model.state?.findings ?? [];
    byId("findings-panel").hidden = findings.length === 0;
    keyed(byId("findings"), findings, (each) => each, () => make("li"), (row, each) => setText(row, sentence(each)));
  }

  private showStructures(operating: boolean): void {
    const { model } = this;
    const seedable = model.seedable();
    const shown = model.state?.structures ?? [];
    const rows: (HeartStructure | null)[] = [null, ...shown];
    keyed(this.structures, rows, (each) => each?.key ?? NOTHING, (each) => this.structureRow(each), (row, each) => {
      const button = row.querySelector<HTMLButtonElement>(".choose")!;
      button.setAttribute("aria-pressed", String(model.chosen === (each?.key ?? null)));
      button.disabled = each !== null && (!operating || !each.seedable);
      if (each === null) return;
      const number = seedable.indexOf(each) + 1;
      setText(row.querySelector("kbd")!, each.seedable && number <= 9 ? String(number) : "");
      setText(row.querySelector(".name")!, each.name);
      const volume = row.querySelector<HTMLElement>(".volume")!;
      setText(volume, each.volume_ml === null ? "" : `${fixed(each.volume_ml, each.volume_ml < 10 ? 1 : 0)} mL`);
      setText(row.querySelector(".change")!, changeText(each));
      setText(row.querySelector(".many")!, "●".repeat(Math.min(3, model.seedsOf(each.key).length)));
      const eye = row.querySelector<HTMLButtonElement>(".eye")!;
      const hidden = model.hidden.has(each.key);
      eye.hidden = each.label === 0;
      eye.setAttribute("aria-pressed", String(!hidden));
      eye.title = hidden ? `Show ${each.name}` : `Hide ${each.name}`;
      eye.setAttribute("aria-label", `Show ${each.name}`);
      row.dataset["hidden"] = String(hidden);
    });
  }

  private structureRow(structure: HeartStructure | null): HTMLElement {
    const row = make("li");
    const button = make("button", "choose");
    button.type = "button";
    button.addEventListener("click", () => this.handlers.onChoose(structure?.key ?? null));
    row.append(button);
    if (structure === null) {
      row.dataset["none"] = "true";
      button.append(make("kbd", "", "Esc"), make("span", "name", "Only look"));
      return row;
    }
    const swatch = make("span", "swatch");
    swatch.style.background = structure.colour;
    const name = make("span", "what");
    name.append(make("span", "name"), make("i", "many"));
    button.append(make("kbd"), swatch, name, make("span", "change"), make("span", "volume"));
    const eye = make("button", "eye round", "👁");
    eye.replaceChildren(eyeIcon());
    eye.type = "button";
    eye.addEventListener("click", () => this.handlers.onHide(structure.key, !this.model.hidden.has(structure.key)));
    row.append(eye);
    return row;
  }

  private showSeeds(operating: boolean): void {
    const { model } = this;
    const seeds = model.state?.seeds ?? [];
    byId("no-seeds").hidden = seeds.length > 0;
    keyed(this.seeds, seeds, (each) => String(each.id), (each) => this.seedRow(each), (row, each) => {
      row.querySelector(".choose")!.setAttribute("aria-pressed", String(model.selected === each.id));
      const name = model.nameOf(each.structure);
      row.querySelector<HTMLElement>(".swatch")!.style.background = model.structure(each.structure)?.colour ?? "";
      setText(row.querySelector(".name")!, name);
      setText(row.querySelector(".where")!, placeText(each.position_mm));
      setText(row.querySelector(".hu")!, `${fixed(each.hu, 0)} HU`);
      const labelled = row.querySelector<HTMLElement>(".labelled")!;
      const wrong = disagreement(each, model);
      setText(labelled, wrong);
      labelled.hidden = wrong === "";
      const remove = row.querySelector<HTMLButtonElement>(".remove")!;
      remove.disabled = !operating;
      remove.setAttribute("aria-label", `Delete the seed of ${name}`);
    });
  }

  private seedRow(seed: HeartSeed): HTMLElement {
    const row = make("li");
    const button = make("button", "choose");
    button.type = "button";
    button.title = "Look at it";
    const find = (): HeartSeed => this.model.seed(seed.id) ?? seed;
    button.addEventListener("click", () => this.handlers.onSelect(find()));
    button.append(make("span", "swatch"), make("span", "name"), make("span", "hu"), make("span", "where"), make("span", "labelled"));
    const remove = make("button", "remove round", "×");
    remove.type = "button";
    remove.title = "Delete";
    remove.addEventListener("click", () => this.handlers.onRemove(find()));
    row.append(button, remove);
    return row;
  }
}

/** Returns how a structure's volume has changed with the last segmentation, as "+12"; empty: it has not. */
export function changeText({ volume_ml, before_ml }: HeartStructure): string {
  if (volume_ml === null || before_ml === null) return "";
  const change = volume_ml - before_ml;
  if (Math.abs(change) < LEAST_CHANGE_ML) return "";
  const text = fixed(change, Math.abs(change) < 10 ? 1 : 0);
  return change > 0 ? `+${text}` : text;
}

/** Returns what the labels have at a seed where that is something else; empty where they agree. */
export function disagreement(seed: HeartSeed, model: SeedsModel): string {
  if (model.state === null || model.state.labels_version === 0) return "";
  if (seed.structure === seed.labelled || (seed.structure === "none" && seed.labelled === "")) return "";
  return seed.labelled === "" ? "labelled as nothing" : `labelled ${model.nameOf(seed.labelled).toLowerCase()}`;
}

function eyeIcon(): SVGElement {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", "M1 8Q8 0 15 8Q8 16 1 8ZM8 5.6a2.4 2.4 0 1 0 .01 0Z");
  svg.append(path);
  return svg;
}
