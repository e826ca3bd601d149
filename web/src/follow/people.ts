/** Who else is connected, and following one of them: their settings and view instead of one's own, until it ends. */

import type { ClientDescription, ClientsMessage, Follow, FollowingMessage, HeadPose, ViewMessage } from "../generated/messages";
import { cleaned } from "../stage/settings";
import type { SettingsStore } from "../stage/settings";
import { guideStepOf } from "./reporter";

/** How long a followed one who was lost is waited for, by name: headsets fall asleep, links break. */
export const WAIT_MS = 120_000;

/** What looks where somebody else looks. */
export interface Looking {
  aim(head: HeadPose, headset: boolean): void;
  release(): void;
}

export interface PeopleHandlers {
  send(message: Follow): boolean;
  /** Something to show has changed. */
  onChange(): void;
  /** Something to tell the person once. */
  onSentence(sentence: string): void;
}

export class People {
  /** Everybody whose view can be followed, oneself apart. */
  others: readonly ClientDescription[] = [];
  self: ClientDescription | null = null;
  followed: ClientDescription | null = null;
  /** Whom one followed and would again, once they are back. */
  awaited: string | null = null;
  /** The step of the guide that whom one follows is at, in words; empty for none. */
  guideStep = "";
  private waiting: ReturnType<typeof setTimeout> | undefined;
  private ownId = "";
  private all: readonly ClientDescription[] = [];

  constructor(
    private readonly store: SettingsStore,
    private readonly looking: Looking,
    private readonly handlers: PeopleHandlers,
  ) {}

  /** A link has opened. */
  greet(ownId: string): void {
    this.ownId = ownId;
  }

  /** The link is gone, and with it whom one follows. */
  leave(): void {
    if (this.followed !== null) this.await(this.followed.name);
    this.end();
    this.all = this.others = [];
    this.self = null;
    this.handlers.onChange();
  }

  follow(id: string): void {
    this.awaited = null;
    this.handlers.send({ type: "follow", client: id });
  }

  stop(): void {
    this.awaited = null;
    this.handlers.send({ type: "follow", client: null });
    this.end();
    this.handlers.onChange();
  }

  takeClients({ clients }: ClientsMessage): void {
    this.all = clients;
    this.self = clients.find(({ id }) => id === this.ownId) ?? null;
    this.others = clients.filter(({ id, kind }) => id !== this.ownId && kind !== "program");
    const { followed } = this;
    if (followed !== null) this.followed = clients.find(({ id }) => id === followed.id) ?? followed;
    this.followAgain();
    this.handlers.onChange();
  }

  takeFollowing({ client, sentence }: FollowingMessage): void {
    const found = client === null ? null : this.all.find(({ id }) => id === client) ?? null;
    if (found === null) {
      const { followed } = this;
      this.end();
      if (followed !== null && sentence !== "") {
        this.others = this.others.filter(({ id }) => id !== followed.id); // the list without them is on its way
        this.await(followed.name);
      }
    } else {
      this.followed = found;
    }
    if (sentence !== "") this.handlers.onSentence(sentence);
    this.followAgain();
    this.handlers.onChange();
  }

  takeView({ client, settings, head }: ViewMessage): void {
    const { followed } = this;
    if (followed === null || followed.id !== client) return;
    this.store.borrow(cleaned(settings), `${followed.name} is followed: stop following to change this yourself.`);
    const step = guideStepOf(settings);
    if (step !== this.guideStep) {
      this.guideStep = step;
      this.handlers.onChange();
    }
    if (head !== null) this.looking.aim(head, followed.kind === "headset");
  }

  private await(name: string): void {
    this.awaited = name;
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => {
      this.awaited = null;
      this.handlers.onChange();
    }, WAIT_MS);
  }

  private followAgain(): void {
    if (this.awaited === null || this.followed !== null) return;
    const back = this.others.find(({ name }) => name === this.awaited);
    if (back !== undefined) this.follow(back.id);
  }

  private end(): void {
    if (this.followed === null) return;
    this.followed = null;
    this.guideStep = "";
    this.store.giveBack();
    this.looking.release();
  }
}
