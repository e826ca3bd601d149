/** The WebSocket link: keeps itself open, knows when it is dead, and says in words what is wrong. */

import type { ClientMessage, Hello, ServerMessage } from "../generated/messages";
import { CLOSE_CODE, PROTOCOL } from "../generated/messages";
import { ClockOffset } from "./clock";

export type LinkPhase = "connecting" | "live" | "lost" | "refused";

export interface LinkState {
  readonly phase: LinkPhase;
  /** What is wrong, as a sentence; empty while all is well. */
  readonly sentence: string;
  /** Page time of the next attempt, ms; null when none is planned. */
  readonly retryAtMs: number | null;
}

export interface LinkHandlers {
  onState(state: LinkState): void;
  onHello(hello: Hello): void;
  onMessage(message: ServerMessage): void;
  /** A ping was answered, this long after it was sent, s. */
  onRoundTrip?(seconds: number): void;
}

/** The part of WebSocket that is used: tests give their own. */
export interface SocketLike {
  readonly readyState: number;
  onopen: ((event: Event) => void) | null;
  onmessage: ((event: MessageEvent) => void) | null;
  onclose: ((event: CloseEvent) => void) | null;
  onerror: ((event: Event) => void) | null;
  send(text: string): void;
  close(code?: number): void;
}

export interface LinkEnvironment {
  open(url: string): SocketLike;
  /** Monotonic page time, ms. */
  now(): number;
  /** From 0 to 1, to spread the attempts of many clients. */
  random(): number;
}

export const PING_EVERY_MS = 2000;
export const DEAD_AFTER_MS = 6000;
export const OPEN_WITHIN_MS = 5000;
const FIRST_PINGS_MS = [0, 200, 500];
const REFUSED_RETRY_MS = 10_000;
const OPEN = 1;

/** Returns the wait before attempt `attempt` (0 for the first): 0.4 s growing to 5 s, spread by up to a quarter. */
export function backoffMs(attempt: number, random: number): number {
  return Math.min(5000, 400 * 1.7 ** attempt) * (0.75 + 0.5 * random);
}

export class Link {
  readonly clock = new ClockOffset();
  /** Links opened so far that got as far as a hello. */
  connections = 0;
  private socket: SocketLike | null = null;
  private attempt = 0;
  private lastHeardMs = 0;
  private phase: LinkPhase = "connecting";
  private refusal: string | null = null;
  private timers = new Set<ReturnType<typeof setTimeout>>();
  private readonly environment: LinkEnvironment;

  constructor(
    private readonly url: string,
    private readonly handlers: LinkHandlers,
    environment?: LinkEnvironment,
  ) {
    this.environment = environment ?? {
      open: (address) => new WebSocket(address),
      now: () => performance.now(),
      random: () => Math.random(),
    };
  }

  /** Opens the link, or opens it again at once when it is waiting to. */
  start(): void {
    if (this.socket !== null) return;
    this.clearTimers();
    if (this.connections === 0 && this.attempt === 0) this.tell("connecting", "", null);
    let socket: SocketLike;
    try {
      socket = this.environment.open(this.url);
    } catch {
      this.lose("This browser did not open a link to the server");
      return;
    }
    this.socket = socket;
    this.lastHeardMs = this.environment.now();
    this.later(OPEN_WITHIN_MS, () => {
      if (this.phase !== "live") this.lose("The server did not answer");
    });
    socket.onopen = () => {
      for (const wait of FIRST_PINGS_MS) this.later(wait, () => this.ping());
      this.later(PING_EVERY_MS, () => this.beat());
    };
    socket.onmessage = (event) => this.hear(event.data);
    socket.onclose = (event) => this.lose(closeSentence(event.code), event.code === CLOSE_CODE.PROTOCOL);
  }

  /** Closes the link for good. */
  stop(): void {
    this.clearTimers();
    this.drop();
  }

  /** Sends a message; returns whether there was a link to send it on. */
  send(message: ClientMessage): boolean {
    if (this.socket === null || this.socket.readyState !== OPEN || this.phase !== "live") return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  /** Acknowledges a Track: cheaper than `send`, as it is done for each one. */
  acknowledge(seq: number): void {
    if (this.socket !== null && this.socket.readyState === OPEN) this.socket.send(`{"type":"ack","seq":${seq}}`);
  }

  private hear(data: unknown): void {
    this.lastHeardMs = this.environment.now();
    const message = parsed(data);
    if (message === null) return;
    if (message.type === "pong") {
      const nowS = this.environment.now() / 1000;
      this.clock.add(message.client_t, message.t, nowS);
      this.handlers.onRoundTrip?.(nowS - message.client_t);
    } else if (message.type === "hello") {
      this.greet(message);
    } else if (message.type === "refusal" && message.code === "protocol") {
      this.refusal = message.sentence;
    } else {
      this.handlers.onMessage(message);
    }
  }

  private greet(hello: Hello): void {
    if (hello.protocol !== PROTOCOL) {
      this.refusal =
        `This page speaks version ${PROTOCOL} of the link and the server (${hello.software}) speaks version ` +
        `${hello.protocol}: reload the page to get the one that fits`;
      this.lose(this.refusal, true);
      return;
    }
    this.attempt = 0;
    this.refusal = null;
    this.connections += 1;
    this.clock.clear(); // it may be another host, or the same one started again
    this.tell("live", "", null);
    this.handlers.onHello(hello);
  }

  private beat(): void {
    if (this.environment.now() - this.lastHeardMs > DEAD_AFTER_MS) {
      this.lose("The server has been silent for 6 seconds");
      return;
    }
    this.ping();
    this.later(PING_EVERY_MS, () => this.beat());
  }

  private ping(): void {
    if (this.socket === null || this.socket.readyState !== OPEN) return;
    this.socket.send(JSON.stringify({ type: "ping", t: this.environment.now() / 1000 }));
  }

  /** Gives the present socket up and plans the next attempt. */
  private lose(sentence: string, refused = this.refusal !== null): void {
    this.clearTimers();
    this.drop();
    const wait = refused ? REFUSED_RETRY_MS : backoffMs(this.attempt++, this.environment.random());
    this.tell(refused ? "refused" : "lost", this.refusal ?? sentence, this.environment.now() + wait);
    this.later(wait, () => this.start());
  }

  private drop(): void {
    const socket = this.socket;
    this.socket = null;
    if (socket === null) return;
    socket.onopen = socket.onmessage = socket.onclose = null;
    socket.onerror = () => undefined;
    try {
      socket.close();
    } catch {
      // it never opened: nothing to close
    }
  }

  private tell(phase: LinkPhase, sentence: string, retryAtMs: number | null): void {
    this.phase = phase;
    this.handlers.onState({ phase, sentence, retryAtMs });
  }

  private later(waitMs: number, action: () => void): void {
    const timer = setTimeout(() => {
      this.timers.delete(timer);
      action();
    }, waitMs);
    this.timers.add(timer);
  }

  private clearTimers(): void {
    for (const timer of this.timers) clearTimeout(timer);
    this.timers.clear();
  }
}

function parsed(data: unknown): ServerMessage | null {
  if (typeof data !== "string") return null;
  try {
    const message: unknown = JSON.parse(data);
    return typeof message === "object" && message !== null && "type" in message ? (message as ServerMessage) : null;
  } catch {
    return null;
  }
}

function closeSentence(code: number): string {
  switch (code) {
    case CLOSE_CODE.GOING_AWAY:
      return "The server was stopped";
    case CLOSE_CODE.PROTOCOL:
      return "The server speaks another version of the link: reload the page";
    case CLOSE_CODE.BUSY:
      return "The server has as many clients as it takes: close the page elsewhere";
    case CLOSE_CODE.MISUSE:
      return "The server closed the link because it did not understand this page: reload it";
    default:
      return "The link to the server broke: it was stopped, or the network is down";
  }
}
