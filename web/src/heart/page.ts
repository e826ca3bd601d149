/** The seeds page's program: the link's messages in, slices and lists on the screen, clicks and keys out. */

import { Actions } from "../calibrate/actions";
import type { Ending } from "../calibrate/ending";
import { endingOf } from "../calibrate/ending";
import type { EventMessage, HeartSeed, HeartSeedsState, Hello, ServerMessage, Vector3 } from "../generated/messages";
import { linkAddress } from "../link/address";
import { Commands } from "../link/commands";
import type { LinkState } from "../link/link";
import { Link } from "../link/link";
import { sentence } from "../maths/format";
import { BannerView } from "../ui/banner";
import { linkCondition } from "../ui/condition";
import { byId, setText } from "../ui/dom";
import { wirePairing } from "../ui/pairing";
import { toast, toastEvent } from "../ui/toasts";
import { showAct, tiltText } from "./act";
import type { PlaneName } from "./geometry";
import { PLANES, placeText, toCt } from "./geometry";
import { keyAct } from "./keys";
import { Lists } from "./lists";
import { SliceLoader } from "./loader";
import { SeedsModel } from "./model";
import { offersFor } from "./offers";
import { SliceInput } from "./slice_input";
import { SliceView, ZOOM_STEP } from "./slice_view";
import { Toolbar } from "./toolbar";

const TICK_MS = 250;
const KEY_HEADER = "x-cathxr-key";

/** What tests and curious people can ask the page: `window.__cathxrSeeds`. */
export interface SeedsHandle {
  readonly link: string;
  readonly role: string;
  readonly stage: string;
  readonly consoleErrors: number;
  readonly cursor: Vector3;
  readonly chosen: string | null;
  /** The columns (4, each x y z w) of ct_from_seen. */
  readonly ctFromSeen: number[][];
  /** Version of the labels that all planes show; 0 while they do not, or show none. */
  readonly labels: number;
  /** Index of the slice that each plane shows; -1 before the first. */
  shown(): Record<string, number>;
  /** Where seen coordinates are on the page, CSS pixels, in a plane. */
  where(plane: PlaneName, seen: Vector3): [number, number];
}

declare global {
  interface Window {
    __cathxrSeeds?: SeedsHandle;
  }
}

export class SeedsPage {
  private readonly link: Link;
  private readonly commands: Commands;
  private readonly actions: Actions;
  private readonly banner = new BannerView(() => this.link.start());
  private readonly model = new SeedsModel(() => this.look(), () => this.redraw());
  private readonly views: Record<PlaneName, SliceView>;
  private readonly toolbar = new Toolbar(this.model);
  private readonly lists: Lists;
  private readonly ct: SliceLoader<Int16Array>;
  private readonly labels: SliceLoader<Uint8Array>;
  private linkState: LinkState = { phase: "connecting", sentence: "", retryAtMs: null };
  private role: Hello["role"] = "viewer";
  private needsPairing = false;
  private ending: Ending | null = null;
  private sliceKey = "";
  private focused: PlaneName = "axial";
  /** The seed that is being placed: a key that deletes it waits until it is there. */
  private placing: Promise<void> = Promise.resolve();
  private hover: { view: SliceView; seen: Vector3 } | null = null;

  constructor(private readonly errors: { readonly count: number }) {
    this.link = new Link(linkAddress(document.baseURI), {
      onState: (state) => this.takeLinkState(state),
      onHello: (hello) => this.takeHello(hello),
      onMessage: (message) => this.take(message),
    });
    this.commands = new Commands((message) => this.link.send(message));
    const read = (path: string): Promise<ArrayBuffer> => this.read(path);
    const handlers = {
      onSlice: (plane: PlaneName) => {
        this.views[plane].refresh();
        this.showReadout();
      },
      onTrouble: (phrase: string) => PLANES.forEach((plane) => this.views[plane].tell(phrase)),
    };
    this.ct = new SliceLoader(read, (data) => new Int16Array(data), handlers);
    this.labels = new SliceLoader(read, (data) => new Uint8Array(data), handlers);
    const loaders = { ct: this.ct, labels: this.labels };
    const view = (name: PlaneName): SliceView => new SliceView(name, this.model, loaders, () => this.enlarge(name));
    this.views = { axial: view("axial"), coronal: view("coronal"), sagittal: view("sagittal") };
    for (const name of PLANES) {
      byId("slices").append(this.views[name].element);
      new SliceInput(this.views[name], this.model, {
        onClick: (seen, add) => (this.placing = this.place(seen, add)),
        onHover: (on, seen) => this.takeHover(on, seen),
        onFocus: (on) => (this.focused = on.name),
      });
    }
    this.lists = new Lists(this.model, {
      onChoose: (structure) => this.choose(structure),
      onSelect: (seed) => this.model.select(seed),
      onRemove: (seed) => this.remove(seed),
      onHide: (structure, hidden) => {
        if (hidden) this.model.hidden.add(structure);
        else this.model.hidden.delete(structure);
        this.model.change();
      },
    });
    this.actions = new Actions((name, args) => this.commands.ask(name, args), (command, result) => this.done(command, result));
    for (const [id, command] of [["undo", "seeds_undo"], ["redo", "seeds_redo"]] as const) {
      byId(id).addEventListener("click", () => void this.ask(command));
    }
    byId("heart").addEventListener("click", () => this.showHeart());
    byId("add").addEventListener("click", () => {
      this.model.adding = !this.model.adding;
      this.model.change();
    });
    wirePairing(this.commands, () => {
      this.role = "operator";
      toast("Paired: this page may place seeds.");
      void this.open();
    });
    addEventListener("online", () => this.link.start());
    addEventListener("keydown", (event) => this.key(event));
    addEventListener("beforeunload", (event) => {
      if (this.ending === null && this.operating && this.model.state?.saved === false) event.preventDefault();
    });
  }

  start(): void {
    this.link.start();
    setInterval(() => this.showLink(performance.now()), TICK_MS);
  }

  handle(): SeedsHandle {
    const page = this;
    return {
      get link() { return page.linkState.phase; },
      get role() { return page.role; },
      get stage() { return page.model.state?.stage ?? ""; },
      get consoleErrors() { return page.errors.count; },
      get cursor() { return page.model.cursor; },
      get chosen() { return page.model.chosen; },
      get labels() {
        const versions = new Set(PLANES.map((plane) => page.views[plane].shownLabels));
        return versions.size === 1 ? [...versions][0]! : 0;
      },
      get ctFromSeen() { return (page.model.state?.ct_from_seen ?? []).map((column, at) => [...column, at === 3 ? 1 : 0]); },
      shown: () => Object.fromEntries(PLANES.map((plane) => [plane, page.views[plane].shown])),
      where: (plane, seen) => page.views[plane].onPage(seen),
    };
  }

  private get operating(): boolean {
    return this.linkState.phase === "live" && this.role === "operator" && this.ending === null;
  }

  // --- messages ---------------------------------------------------------------------------------------------------

  private take(message: ServerMessage): void {
    if (message.type === "heart_seeds") this.takeState(message);
    else if (message.type === "event") this.takeEvent(message);
    else if (message.type === "refusal" && !this.commands.takeRefusal(message)) toast(message.sentence, "bad");
  }

  private takeState(state: HeartSeedsState): void {
    const before = this.model.state;
    this.showFolders(state.labels_version);
    this.model.take(state);
    if (before?.labels_box.length !== 2 && state.labels_box.length === 2) this.showHeart(); // once: then the view is the person's
    if (before?.stage === "segmenting" && state.stage === "ready" && before.labels_version !== state.labels_version) {
      toast("Segmented: the new labels are shown.");
    }
    this.refresh();
  }

  private takeEvent(event: EventMessage): void {
    if (this.commands.takeEvent(event)) return;
    if (event.kind === "seeds_ended") this.end(event.payload ?? {});
    else toastEvent(event);
  }

  private takeLinkState(state: LinkState): void {
    const was = this.linkState.phase;
    this.linkState = state;
    if (was === "live" && state.phase !== "live") this.commands.abandon();
    this.refresh();
  }

  private takeHello(hello: Hello): void {
    this.role = hello.role;
    this.needsPairing = hello.needs_pairing;
    this.ending = null;
    this.sliceKey = "";
    this.refresh();
    if (hello.role === "operator") void this.open();
  }

  /** Asks for the key to the slices: only operators are given it. */
  private async open(): Promise<void> {
    const answer = await this.commands.ask("seeds_open");
    if (answer.done && typeof answer.result["key"] === "string") this.sliceKey = answer.result["key"];
    this.showFolders(this.model.state?.labels_version ?? 0);
    this.refresh();
  }

  private showFolders(version: number): void {
    this.ct.from(this.sliceKey === "" ? "" : "ct");
    this.labels.from(this.sliceKey === "" || version === 0 ? "" : `labels/${version}`);
  }

  private async read(path: string): Promise<ArrayBuffer> {
    const answer = await fetch(new URL(`heart/${path}`, document.baseURI), { headers: { [KEY_HEADER]: this.sliceKey } });
    if (!answer.ok) throw new Error(`${answer.status}`);
    return answer.arrayBuffer();
  }

  // --- what a person does -----------------------------------------------------------------------------------------

  private async ask(name: string, args: Record<string, unknown> = {}): Promise<Record<string, unknown> | null> {
    const answer = await this.commands.ask(name, args);
    if (!answer.done) toast(answer.sentence, "bad");
    return answer.done ? answer.result : null;
  }

  private choose(structure: string | null): void {
    this.model.choose(structure);
    this.refresh();
  }

  private async place(seen: Vector3, add: boolean): Promise<void> {
    const { chosen, selected, state } = this.model;
    if (chosen === null || state === null || !this.operating) return;
    const args = { structure: chosen, position_mm: [...toCt(state.ct_from_seen, seen)], add, ...(selected === null ? {} : { seed: selected }) };
    this.model.adding = false;
    const result = await this.ask("seeds_place", args);
    if (typeof result?.["seed"] === "number") {
      this.model.selected = result["seed"];
      this.model.change();
      this.refresh();
    }
  }

  private remove(seed: HeartSeed | null): void {
    if (seed !== null && this.operating) void this.ask("seeds_remove", { seed: seed.id });
  }

  private enlarge(name: PlaneName): void {
    this.model.large = name;
    byId("slices").dataset["large"] = name;
  }

  /** Shows the labelled heart, or where there is none the whole scan, as large as it goes in all three views. */
  private showHeart(): void {
    const [low, high] = this.model.state?.labels_box ?? [];
    for (const name of PLANES) {
      if (low === undefined || high === undefined) this.views[name].whole();
      else this.views[name].zoomOn(low, high);
    }
    if (low !== undefined && high !== undefined) {
      this.model.look([0, 1, 2].map((axis) => Math.round((low[axis]! + high[axis]!) / 2)) as unknown as Vector3);
    }
  }

  private takeHover(view: SliceView, seen: Vector3 | null): void {
    this.hover = seen === null ? null : { view, seen };
    this.showReadout();
  }

  private key(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    if (target.closest("input:not([type=range]), dialog, select") !== null || this.model.state === null || this.ending !== null) return;
    const asked = keyAct(event, this.focused);
    const onControl = target.closest("button, input") !== null;
    // What a control does with a key itself stays with it.
    if (asked === null || (onControl && (asked.act === "place" || asked.act === "cursor"))) return;
    event.preventDefault();
    const view = this.views[this.focused];
    const { model } = this;
    switch (asked.act) {
      case "cursor": {
        const [x, y, z] = model.cursor.map((each, axis) => Math.round(each) + asked.step[axis]!) as [number, number, number];
        return model.look([x, y, z]);
      }
      case "choose": return this.operating ? this.choose(model.seedable()[asked.number - 1]?.key ?? null) : undefined;
      case "zoom": return asked.by === 0 ? view.whole() : view.zoomBy(ZOOM_STEP ** asked.by);
      case "look": return this.choose(null);
      case "place": case "add": this.placing = this.place(model.cursor, asked.act === "add"); return;
      case "remove": return void this.placing.then(() => this.remove(model.selected === null ? null : model.seed(model.selected)));
      case "undo": case "redo": return void (this.operating && this.ask(`seeds_${asked.act}`));
      case "save": return this.actions.press("seeds_save");
      case "heart": return this.showHeart();
      case "overlay": return this.toolbar.nextOverlay();
      case "window": return this.toolbar.nextWindow();
    }
  }

  private done(command: string, result: Record<string, unknown>): void {
    if (command === "seeds_done") this.end(result);
    else if (typeof result["sentence"] === "string") toast(result["sentence"]);
  }

  private end(told: Record<string, unknown>): void {
    const ending = endingOf(told);
    if (ending === null) return;
    this.ending = { ...ending, title: ending.saved ? "Done" : "Closed" };
    this.refresh();
  }

  // --- what is shown ----------------------------------------------------------------------------------------------

  /** Shows what this page alone decides. */
  private redraw(): void {
    this.look();
    this.toolbar.refresh();
    this.lists.refresh(this.operating);
    byId("add").setAttribute("aria-pressed", String(this.model.adding));
    byId("slices").dataset["placing"] = String(this.model.chosen !== null && this.operating);
  }

  private look(): void {
    for (const name of PLANES) this.views[name].refresh();
    this.showReadout();
  }

  private refresh(): void {
    const { state } = this.model;
    const live = this.linkState.phase === "live";
    document.body.dataset["ended"] = String(this.ending !== null);
    byId("role").hidden = !(live && this.role === "viewer");
    byId("pairing").hidden = !(live && this.role === "viewer" && this.needsPairing);
    const tilt = state === null ? "" : tiltText(state);
    byId("tilt").hidden = tilt === "";
    setText(byId("tilt"), tilt);
    byId<HTMLButtonElement>("undo").disabled = !(this.operating && state?.can_undo);
    byId<HTMLButtonElement>("redo").disabled = !(this.operating && state?.can_redo);
    byId<HTMLButtonElement>("add").disabled = !(this.operating && this.model.chosen !== null);
    showAct(state, live);
    this.actions.show(state === null || this.ending !== null ? [] : offersFor(state, this.viewing(live)));
    byId("ended").hidden = this.ending === null;
    setText(byId("ended-title"), this.ending?.title ?? "");
    setText(byId("ended-text"), sentence(this.ending?.sentence ?? ""));
    byId("ended").dataset["saved"] = String(this.ending?.saved ?? false);
    if (live && this.role === "viewer") for (const name of PLANES) this.views[name].tell("shown to operators only");
    this.redraw();
    this.showLink(performance.now());
  }

  /** Returns why this page may not command; empty: it may. */
  private viewing(live: boolean): string {
    if (!live) return "There is no link to the server.";
    if (this.role === "operator") return "";
    return this.needsPairing ? "Viewing only: enter the pairing code above." : "Viewing only: use the computer on which the server runs.";
  }

  private showReadout(): void {
    const { model, hover } = this;
    if (model.state === null) return;
    const seen = hover?.seen ?? model.cursor;
    const { hu, label } = (hover?.view ?? this.views[this.focused]).valuesAt(seen);
    const structure = model.state.structures.find((each) => each.label === label && label !== 0);
    const parts = [hu === null ? "" : `${hu < 0 ? "−" : ""}${Math.abs(hu)} HU`, structure?.name ?? "", placeText(toCt(model.state.ct_from_seen, seen))];
    setText(byId("readout"), parts.filter((each) => each !== "").join("   ·   "));
  }

  private showLink(nowMs: number): void {
    const { phase } = this.linkState;
    const now = phase === "live" ? null : linkCondition(this.linkState, nowMs, this.model.state !== null);
    const status = byId("status");
    setText(status, this.ending !== null ? "finished" : now?.label ?? "connected");
    status.dataset["level"] = this.ending !== null ? "idle" : now?.level ?? "good";
    this.banner.show(this.ending !== null ? null : now?.banner ?? null);
    byId("work").dataset["stale"] = String(now?.stale ?? false);
  }
}
