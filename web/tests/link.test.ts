import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import { CLOSE_CODE, PROTOCOL } from "../src/generated/messages";
import type { LinkState, SocketLike } from "../src/link/link";
import { backoffMs, DEAD_AFTER_MS, Link, OPEN_WITHIN_MS } from "../src/link/link";

class FakeSocket implements SocketLike {
  readyState = 0;
  onopen: ((event: Event) => void) | null = null;
  onmessage: ((event: MessageEvent) => void) | null = null;
  onclose: ((event: CloseEvent) => void) | null = null;
  onerror: ((event: Event) => void) | null = null;
  sent: string[] = [];
  closed = false;

  send(text: string): void {
    this.sent.push(text);
  }
  close(): void {
    this.closed = true;
  }
  accept(hello: Record<string, unknown> = {}): void {
    this.readyState = 1;
    this.onopen?.({} as Event);
    this.say({ type: "hello", protocol: PROTOCOL, software: "cathxr 1", frames: {}, units: {}, role: "viewer", source: "twin", needs_pairing: false, ...hello });
  }
  say(message: unknown): void {
    this.onmessage?.({ data: JSON.stringify(message) } as MessageEvent);
  }
  breakWith(code: number): void {
    this.readyState = 3;
    this.onclose?.({ code } as CloseEvent);
  }
}

function makeLink(): { link: Link; sockets: FakeSocket[]; states: LinkState[]; heard: string[] } {
  const sockets: FakeSocket[] = [];
  const states: LinkState[] = [];
  const heard: string[] = [];
  const link = new Link(
    "ws://here/ws",
    { onState: (state) => states.push(state), onHello: () => heard.push("hello"), onMessage: (message) => heard.push(message.type) },
    {
      open: () => {
        sockets.push(new FakeSocket());
        return sockets.at(-1)!;
      },
      now: () => Date.now(),
      random: () => 0.5,
    },
  );
  return { link, sockets, states, heard };
}

describe("Link", () => {
  beforeEach(() => void vi.useFakeTimers());
  afterEach(() => void vi.useRealTimers());

  it("is live after hello, passes messages on, and pings", () => {
    const { link, sockets, states, heard } = makeLink();
    link.start();
    expect(states.at(-1)!.phase).toBe("connecting");
    sockets[0]!.accept();
    expect(states.at(-1)!.phase).toBe("live");
    sockets[0]!.say({ type: "session", recording: false, name: null, seconds: 0 });
    expect(heard).toEqual(["hello", "session"]);
    vi.advanceTimersByTime(2100);
    expect(sockets[0]!.sent.filter((text) => text.includes('"ping"')).length).toBe(4);
    link.acknowledge(12);
    expect(JSON.parse(sockets[0]!.sent.at(-1)!)).toEqual({ type: "ack", seq: 12 });
  });

  it("says that it is lost and opens again by itself, ever more slowly, until it succeeds", () => {
    const { link, sockets, states } = makeLink();
    link.start();
    sockets[0]!.accept();
    sockets[0]!.breakWith(1006);
    expect(states.at(-1)!.phase).toBe("lost");
    expect(states.at(-1)!.sentence).toContain("broke");
    let waited = 0;
    for (let attempt = 0; attempt < 6; attempt++) {
      const planned = states.at(-1)!.retryAtMs! - Date.now();
      expect(planned).toBeGreaterThan(waited - 1);
      expect(planned).toBeCloseTo(backoffMs(attempt, 0.5), 2); // Date.now() of today leaves 1e-4 ms
      waited = planned;
      vi.advanceTimersByTime(planned + 1);
      expect(sockets.length).toBe(attempt + 2);
      sockets.at(-1)!.breakWith(1006);
    }
    expect(waited).toBeLessThanOrEqual(5000 * 1.25);
    vi.advanceTimersByTime(6000);
    sockets.at(-1)!.accept();
    expect(states.at(-1)!.phase).toBe("live");
    expect(link.connections).toBe(2);
  });

  it("gives up a socket that is open but silent", () => {
    const { link, sockets, states } = makeLink();
    link.start();
    sockets[0]!.accept();
    vi.advanceTimersByTime(DEAD_AFTER_MS + 2100);
    expect(sockets[0]!.closed).toBe(true);
    expect(states.some((state) => state.phase === "lost" && state.sentence.includes("silent"))).toBe(true);
  });

  it("gives up a socket that never opens", () => {
    const { link, sockets, states } = makeLink();
    link.start();
    vi.advanceTimersByTime(OPEN_WITHIN_MS + 1);
    expect(states.at(-1)!.phase).toBe("lost");
    vi.advanceTimersByTime(2000);
    expect(sockets.length).toBe(2);
  });

  it("ignores what an old socket still says", () => {
    const { link, sockets, heard } = makeLink();
    link.start();
    sockets[0]!.accept();
    sockets[0]!.breakWith(1006);
    sockets[0]!.say({ type: "track" });
    expect(heard).toEqual(["hello"]);
  });

  it("says in words that the versions differ, by hello or by refusal", () => {
    const first = makeLink();
    first.link.start();
    first.sockets[0]!.accept({ protocol: PROTOCOL + 1, software: "cathxr 9" });
    expect(first.states.at(-1)).toMatchObject({ phase: "refused" });
    expect(first.states.at(-1)!.sentence).toContain("cathxr 9");
    const second = makeLink();
    second.link.start();
    second.sockets[0]!.readyState = 1;
    second.sockets[0]!.onopen?.({} as Event);
    second.sockets[0]!.say({ type: "refusal", code: "protocol", sentence: "Please update.", id: null });
    second.sockets[0]!.breakWith(CLOSE_CODE.PROTOCOL);
    expect(second.states.at(-1)).toMatchObject({ phase: "refused", sentence: "Please update." });
  });

  it("learns the host's clock and survives nonsense", () => {
    const { link, sockets } = makeLink();
    link.start();
    sockets[0]!.accept();
    const sent = JSON.parse(sockets[0]!.sent.find((text) => text.includes("ping")) ?? '{"t":0}') as { t: number };
    sockets[0]!.say({ type: "pong", client_t: Date.now() / 1000, t: Date.now() / 1000 + 77 });
    expect(sent.t).toBeGreaterThanOrEqual(0);
    expect(link.clock.offsetS).toBeCloseTo(77, 3);
    sockets[0]!.onmessage?.({ data: "{nonsense" } as MessageEvent);
    sockets[0]!.onmessage?.({ data: "null" } as MessageEvent);
  });

  it("opens at once when asked to while it waits, and closes for good", () => {
    const { link, sockets } = makeLink();
    link.start();
    sockets[0]!.breakWith(1006);
    link.start();
    expect(sockets.length).toBe(2);
    link.stop();
    vi.advanceTimersByTime(60_000);
    expect(sockets.length).toBe(2);
    expect(link.send({ type: "ping", t: 0 })).toBe(false);
  });
});
