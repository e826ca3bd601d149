/** The page among others: tells what it looks at, follows somebody, and takes what is locked for everybody. */

import type { Hello, ServerMessage, ViewReport, Follow } from "../generated/messages";
import type { Stage } from "../stage/stage";
import { PeoplePanel } from "../ui/people";
import { toast } from "../ui/toasts";
import { Mirror } from "./mirror";
import { People } from "./people";
import { REPORT_EVERY_MS, ViewReporter } from "./reporter";

export class Company {
  readonly people: People;
  /** To be added to the stage's features. */
  readonly mirror: Mirror;
  /** The step of the guide that is shown here, in words: followers are told. */
  guideStep: () => string = () => "";
  private readonly panel: PeoplePanel;
  private readonly reporter: ViewReporter;
  /** Whether the server has said, since the link opened, that something is locked. */
  private toldOfLock = false;

  constructor(private readonly stage: Stage, send: (message: ViewReport | Follow) => boolean) {
    this.mirror = new Mirror(stage.view);
    this.reporter = new ViewReporter(stage.view, stage.world, send);
    this.people = new People(stage.store, this.mirror, {
      send,
      onChange: () => this.panel.show(),
      onSentence: (sentence) => toast(sentence, "bad"),
    });
    this.panel = new PeoplePanel(this.people);
    // A hidden page draws no frames, and its settings may change nevertheless.
    stage.store.listen(() => setTimeout(() => this.update(performance.now()), REPORT_EVERY_MS));
  }

  greet(hello: Hello): void {
    this.toldOfLock = false;
    this.people.greet(hello.client);
    this.reporter.forget();
  }

  leave(): void {
    this.people.leave();
  }

  /** Takes a message; returns whether it was one of these. */
  take(message: ServerMessage): boolean {
    switch (message.type) {
      case "clients":
        // What was locked stays so while the link is down. It comes before this message, where it still is.
        if (!this.toldOfLock && this.stage.store.lock !== null) this.stage.store.hold(null);
        this.people.takeClients(message);
        return true;
      case "following":
        this.people.takeFollowing(message);
        return true;
      case "view":
        this.people.takeView(message);
        return true;
      case "lock":
        this.toldOfLock = Object.keys(message.values).length > 0;
        this.stage.store.hold(this.toldOfLock ? message : null);
        return true;
      default:
        return false;
    }
  }

  /** Called once for each frame, after everything has moved. */
  update(nowMs: number): void {
    this.reporter.update(nowMs, this.stage.store.value, this.guideStep());
  }
}
