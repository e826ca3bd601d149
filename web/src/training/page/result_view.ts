/** How a trial went: in words, with the score card below, and the way to see it again. */

import type { CardLineMessage } from "../../generated/messages";
import { make, setText } from "../../ui/dom";
import type { Desk } from "../desk";
import type { TrainingModel } from "../model";
import { spark } from "../spark";
import { BETTER, outcomeWords, runWords, standingWords, tookWords, trend, valueWords } from "../words";
import { button, say, svg } from "./parts";

/** As many are shown at first (training.css has the same number). */
const FEW = 6;
const SPARK = { width: 92, height: 26 };

export class ResultView {
  readonly element = make("div", "training-result");
  private readonly title = make("strong", "training-outcome");
  private readonly who = make("p", "faint");
  private readonly sentence = make("p");
  private readonly invalid = make("p", "trouble");
  private readonly stored = make("p", "faint");
  private readonly card = make("ul", "score-card");
  private readonly wait = make("p", "faint", "The figures are being worked out …");
  private readonly repeat = button("Repeat", () => void this.desk.repeat());
  private readonly again = button("Show the run", () => this.onShow());
  private readonly store = button("Store again", () => void this.desk.store());
  private readonly close = button("Done", () => void this.desk.close(), "main");
  private readonly buttons = make("div", "training-buttons");
  private readonly more = button("", () => this.toggleAll(), "more");
  private readonly key = make("p", "faint", "A line shows your trials so far, the newest at its end; up is better.");
  private drawn = "";

  constructor(private readonly model: TrainingModel, private readonly desk: Desk, private readonly onShow: () => void) {
    this.card.setAttribute("aria-label", "Score card");
    this.buttons.append(this.close, this.repeat, this.again, this.store);
    this.element.append(this.title, this.who, this.sentence, this.invalid, this.buttons, this.wait, this.card, this.more, this.key, this.stored);
    this.element.setAttribute("role", "group");
    this.element.setAttribute("aria-label", "Result");
  }

  show(): void {
    const { model, desk } = this;
    const { result, run } = model;
    this.element.hidden = result === null;
    if (result === null) return;
    this.element.dataset["outcome"] = result.outcome;
    setText(this.title, `${outcomeWords(result)} in ${tookWords(result.active_s)}`);
    say(this.who, run === null ? "" : runWords(run));
    say(this.sentence, result.sentence);
    say(this.invalid, result.invalid === "" ? "" : `It does not count: ${result.invalid}`);
    say(this.stored, result.stored);
    this.close.hidden = this.repeat.hidden = !model.operating;
    this.close.disabled = !model.can("training_close") || desk.busy;
    this.repeat.disabled = !model.can("training_repeat") || desk.busy;
    this.again.hidden = result.run === null;
    this.store.hidden = !model.can("training_store");
    this.wait.hidden = result.lines.length > 0 || result.outcome === "interrupted";
    const key = JSON.stringify(result.lines);
    if (key === this.drawn) return;
    this.drawn = key;
    this.card.replaceChildren(...result.lines.map(makeLine));
    delete this.card.dataset["all"];
    this.key.hidden = result.lines.length === 0;
    this.more.hidden = result.lines.length <= FEW;
    this.nameMore();
  }

  private toggleAll(): void {
    if ("all" in this.card.dataset) delete this.card.dataset["all"];
    else this.card.dataset["all"] = "";
    this.nameMore();
  }

  private nameMore(): void {
    const all = "all" in this.card.dataset;
    setText(this.more, all ? "Fewer figures" : `All ${this.card.children.length} figures`);
    this.more.setAttribute("aria-expanded", String(all));
  }
}

/** One metric: its name and value, how it went so far, how it stands. */
function makeLine(line: CardLineMessage): HTMLLIElement {
  const item = make("li");
  const { arrow, words } = BETTER[line.better];
  const change = trend(line);
  if (line.is_best) item.dataset["best"] = "";
  if (change !== null) item.dataset["trend"] = change;
  const name = make("span", "name", line.name);
  const way = make("span", "way", arrow);
  way.title = words;
  way.setAttribute("aria-label", words);
  if (arrow === "") way.setAttribute("aria-hidden", "true");
  else name.append(" ", way);
  const value = make("b", "value", valueWords(line.value, line.unit));
  if (line.is_best && line.best_before !== null) value.append(make("span", "star", "★"));
  item.append(name, value, makeSpark(line), make("span", "standing", standingWords(line)));
  return item;
}

function makeSpark(line: CardLineMessage): SVGSVGElement {
  const { points, path } = spark(line.history, line.better === "higher", SPARK.width, SPARK.height);
  const picture = svg("svg", { viewBox: `0 0 ${SPARK.width} ${SPARK.height}`, class: "spark", role: "img" });
  const values = line.history.map(([, value]) => valueWords(value, line.unit)).join(", ");
  picture.setAttribute("aria-label", line.history.length === 0 ? "No trials yet" : `Trials so far: ${values}`);
  const title = svg("title", {});
  title.textContent = values;
  picture.append(title);
  if (path !== "") picture.append(svg("path", { d: path }));
  const last = points.at(-1);
  if (last !== undefined) picture.append(svg("circle", { cx: String(last[0]), cy: String(last[1]), r: "2.6" }));
  return picture;
}
