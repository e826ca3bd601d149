import { afterEach, beforeEach, describe, expect, it, vi } from "vitest";
import type { ClientMessage, EventMessage, Refusal } from "../src/generated/messages";
import type { Answer } from "../src/link/commands";
import { ANSWER_WITHIN_MS, Commands } from "../src/link/commands";
import { Steering } from "../src/link/steering";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

describe("Commands", () => {
  it("matches answers and refusals with what was asked", async () => {
    const sent: ClientMessage[] = [];
    const commands = new Commands((message) => sent.push(message) > 0);
    const first = commands.ask("steer", { roll_deg: 3 });
    const second = commands.ask("record_start");
    const [a, b] = sent as { id: string; name: string }[];
    const done: EventMessage = { type: "event", t: 1, kind: "done", payload: { id: a!.id, name: "steer", result: { roll_deg: 3 } } };
    const refusal: Refusal = { type: "refusal", code: "role", sentence: "Pair first.", id: b!.id };
    expect(commands.takeRefusal(refusal)).toBe(true);
    expect(commands.takeEvent(done)).toBe(true);
    expect(commands.takeEvent(done)).toBe(false);
    expect(await first).toEqual({ done: true, result: { roll_deg: 3 } });
    expect(await second).toEqual({ done: false, sentence: "Pair first." });
  });

  it("fails without a link, without an answer, and when the link breaks", async () => {
    expect(await new Commands(() => false).ask("steer")).toMatchObject({ done: false });
    const commands = new Commands(() => true);
    const late = commands.ask("steer");
    vi.advanceTimersByTime(ANSWER_WITHIN_MS + 1);
    expect(await late).toMatchObject({ done: false });
    const broken = commands.ask("steer");
    commands.abandon();
    expect(await broken).toMatchObject({ done: false });
  });
});

describe("Steering", () => {
  it("has one command on its way; of what piled up meanwhile the newest is sent", async () => {
    const asked: Record<string, unknown>[] = [];
    const answers: ((answer: Answer) => void)[] = [];
    const steering = new Steering((_, args) => {
      asked.push(args);
      return new Promise((resolve) => answers.push(resolve));
    }, () => undefined);
    steering.set("roll_deg", 1);
    for (let value = 2; value <= 50; value++) steering.set("roll_deg", value);
    steering.set("insertion_mm", 70);
    expect(asked).toEqual([{ roll_deg: 1 }]);
    answers[0]!({ done: true, result: {} });
    await vi.advanceTimersByTimeAsync(40);
    expect(asked).toEqual([{ roll_deg: 1 }, { roll_deg: 50, insertion_mm: 70 }]);
    answers[1]!({ done: true, result: {} });
    await vi.advanceTimersByTimeAsync(40);
    steering.set("left_deg", 5);
    expect(asked.at(-1)).toEqual({ left_deg: 5 });
  });

  it("hands a refusal on and drops what was waiting", async () => {
    const refusals: string[] = [];
    let count = 0;
    const steering = new Steering(async () => {
      count += 1;
      return { done: false, sentence: "Viewers may not steer." };
    }, (sentence) => refusals.push(sentence));
    steering.set("roll_deg", 1);
    steering.set("roll_deg", 2);
    await vi.advanceTimersByTimeAsync(100);
    expect(refusals).toEqual(["Viewers may not steer."]);
    expect(count).toBe(1);
  });
});
