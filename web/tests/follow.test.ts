import { Matrix4, Object3D, Quaternion, Vector3 } from "three";
import { describe, expect, it, vi } from "vitest";
import type { ClientDescription, Follow, ViewMessage, ViewReport } from "../src/generated/messages";
import { fromRotationVector, Glide, rotationVector } from "../src/follow/glide";
import { People, WAIT_MS } from "../src/follow/people";
import { isHeadsetBrowser, REPORT_EVERY_MS, ViewReporter } from "../src/follow/reporter";
import { DEFAULTS, SettingsStore } from "../src/stage/settings";

const X = new Vector3(1, 0, 0);

describe("the glide", () => {
  it("comes close fast, never swings past, and does not jump", () => {
    const glide = new Glide(14);
    glide.start(new Vector3(0, 0, 0), new Quaternion());
    glide.aim(new Vector3(1, 0, 0), new Quaternion().setFromAxisAngle(X, 2));
    let last = 0;
    for (let ms = 0; ms < 500; ms += 10) {
      glide.step(0.01);
      expect(glide.position.x).toBeGreaterThanOrEqual(last);
      expect(glide.position.x).toBeLessThanOrEqual(1 + 1e-12);
      // The steepest that this spring gets: stiffness / e of the way a second.
      expect(glide.position.x - last).toBeLessThan((14 / Math.E) * 0.01 * 1.05);
      last = glide.position.x;
    }
    expect(1 - last).toBeLessThan(0.01); // (1 + 7) exp(-7) of the way after 7 / stiffness seconds
    expect(glide.orientation.angleTo(new Quaternion().setFromAxisAngle(X, 2))).toBeLessThan(0.02);
  });

  it("is the same with small and large steps, and rests in the end", () => {
    const [fine, coarse] = [new Glide(14), new Glide(14)];
    for (const each of [fine, coarse]) {
      each.start(new Vector3(), new Quaternion());
      each.aim(new Vector3(0.3, -0.2, 0.1), new Quaternion().setFromAxisAngle(X, -1));
    }
    for (let step = 0; step < 30; step++) fine.step(0.01);
    for (let step = 0; step < 3; step++) coarse.step(0.1);
    expect(fine.position.distanceTo(coarse.position)).toBeLessThan(1e-9);
    expect(fine.orientation.angleTo(coarse.orientation)).toBeLessThan(1e-6);
    let moving = true;
    for (let step = 0; step < 300 && moving; step++) moving = coarse.step(0.02);
    expect(moving).toBe(false);
  });

  it("turns the short way round", () => {
    const glide = new Glide(14);
    glide.start(new Vector3(), new Quaternion().setFromAxisAngle(X, 3));
    glide.aim(new Vector3(), new Quaternion().setFromAxisAngle(X, -3)); // 0.28 rad over the back, not 6 rad
    let turned = 0;
    const before = glide.orientation.clone();
    for (let step = 0; step < 100; step++) {
      glide.step(0.01);
      turned += glide.orientation.angleTo(before);
      before.copy(glide.orientation);
    }
    expect(turned).toBeCloseTo(2 * Math.PI - 6, 2);
  });

  it("knows rotations as vectors, there and back", () => {
    for (const angle of [0, 1e-12, 0.4, 3.1]) {
      const axis = new Vector3(1, -2, 0.5).normalize();
      const turn = rotationVector(new Quaternion().setFromAxisAngle(axis, angle), new Vector3());
      expect(turn.length()).toBeCloseTo(angle, 9);
      expect(fromRotationVector(turn, new Quaternion()).angleTo(new Quaternion().setFromAxisAngle(axis, angle))).toBeLessThan(1e-6);
    }
  });
});

function client(id: string, name: string, kind: ClientDescription["kind"] = "headset"): ClientDescription {
  return { id, name, kind, role: "viewer" };
}

function view(of: string, settings: Record<string, unknown>): ViewMessage {
  return { type: "view", client: of, settings, head: { position_mm: [1, 2, 3], orientation_wxyz: [1, 0, 0, 0] }, world: null };
}

function company() {
  const store = new SettingsStore();
  const sent: Follow[] = [];
  const said: string[] = [];
  const looks: string[] = [];
  const people = new People(
    store,
    { aim: (head, headset) => looks.push(`${head.position_mm[0]} ${headset}`), release: () => looks.push("own") },
    { send: (message) => sent.push(message) > 0, onChange: () => undefined, onSentence: (sentence) => said.push(sentence) },
  );
  people.greet("1");
  people.takeClients({ type: "clients", clients: [client("1", "Desktop 1", "desktop"), client("2", "Headset 1"), client("3", "Program 1", "program")] });
  return { store, sent, said, looks, people };
}

describe("following", () => {
  it("lists those who have a view, oneself apart", () => {
    const { people } = company();
    expect(people.others.map(({ name }) => name)).toEqual(["Headset 1"]);
    expect(people.self?.name).toBe("Desktop 1");
  });

  it("shows the other's settings and view, and one's own afterwards", () => {
    const { people, store, sent, looks } = company();
    store.set({ gainDb: 7 });
    people.follow("2");
    expect(sent.at(-1)).toEqual({ type: "follow", client: "2" });
    people.takeFollowing({ type: "following", client: "2", sentence: "" });
    people.takeView(view("2", { ice: true, gainDb: -3, nonsense: 4 }));
    expect(store.value).toMatchObject({ ice: true, gainDb: -3 });
    expect(looks).toEqual(["1 true"]);
    expect(store.locked("gainDb")).toBe(true);
    expect(store.why("gainDb")).toContain("Headset 1");
    store.set({ gainDb: 12 });
    expect(store.value.gainDb).toBe(-3);
    people.takeView(view("9", { gainDb: 20 })); // somebody else's: late, or wrong
    expect(store.value.gainDb).toBe(-3);
    people.stop();
    expect(store.value).toEqual({ ...DEFAULTS, gainDb: 7 });
    expect(looks.at(-1)).toBe("own");
    people.takeView(view("2", { gainDb: 5 })); // was on its way
    expect(store.value.gainDb).toBe(7);
  });

  it("waits for who has left, and follows them again when they are back", () => {
    vi.useFakeTimers();
    const { people, store, sent, said } = company();
    people.follow("2");
    people.takeFollowing({ type: "following", client: "2", sentence: "" });
    people.takeView(view("2", { ice: true }));
    sent.length = 0;
    people.takeFollowing({ type: "following", client: null, sentence: "Headset 1 has left." });
    expect(said).toEqual(["Headset 1 has left."]);
    expect(store.value.ice).toBe(false);
    expect(people.awaited).toBe("Headset 1");
    expect(sent).toEqual([]); // not the one who has just left
    people.takeClients({ type: "clients", clients: [client("1", "Desktop 1", "desktop"), client("8", "Headset 1")] });
    expect(sent).toEqual([{ type: "follow", client: "8" }]);
    people.takeFollowing({ type: "following", client: "8", sentence: "" });
    people.leave(); // the link breaks
    expect(people.awaited).toBe("Headset 1");
    vi.advanceTimersByTime(WAIT_MS + 1);
    expect(people.awaited).toBeNull();
    vi.useRealTimers();
  });
});

describe("the settings' layers", () => {
  it("let what is locked win over what is borrowed, and both go away again", () => {
    const kept = new Map<string, string>();
    const storage = { getItem: (key: string) => kept.get(key) ?? null, setItem: (key: string, text: string) => void kept.set(key, text) };
    const store = new SettingsStore(storage as Storage);
    const heard: string[] = [];
    store.listen((now) => heard.push(`${now.mode} ${now.depthMm}`));
    store.set({ depthMm: 60 });
    store.borrow({ depthMm: 120, mode: "3d" }, "Somebody is followed.");
    store.hold({ values: { mode: "2d" }, sentence: "A training session shows 2D only." });
    expect(heard.at(-1)).toBe("2d 120");
    expect(store.why("mode")).toContain("training");
    expect(store.why("depthMm")).toContain("followed");
    store.giveBack();
    expect(store.value).toMatchObject({ mode: "2d", depthMm: 60 });
    expect(store.locked("depthMm")).toBe(false);
    store.set({ mode: "3d", depthMm: 70 });
    expect(store.value).toMatchObject({ mode: "2d", depthMm: 70 });
    expect(JSON.parse(kept.get("cathxr.scene")!)).toMatchObject({ mode: "3d", depthMm: 70 });
    store.hold(null);
    expect(heard.at(-1)).toBe("3d 70");
  });

  it("give the whole heart's opacity to parts that had their own", () => {
    const store = new SettingsStore();
    store.setPart("aorta", { opacity: 0.9, visible: false });
    store.set({ heartOpacity: 0.5 });
    expect(store.part("aorta")).toEqual({ visible: false, opacity: 0.5 });
  });
});

describe("what this page looks at", () => {
  vi.stubGlobal("navigator", { userAgent: "Mozilla/5.0 (X11; Linux x86_64) Chrome/140" });
  const setting = () => {
    const scene = new Object3D();
    const world = new Object3D();
    const box = new Object3D();
    const camera = new Object3D();
    box.scale.setScalar(0.001);
    box.rotation.x = -Math.PI / 2;
    scene.add(world, camera);
    world.add(box);
    const sent: ViewReport[] = [];
    const eyes = { camera, box, immersive: false, head: { position: new Vector3(), orientation: new Quaternion() } };
    return { world, camera, eyes, sent, reporter: new ViewReporter(eyes, world, (report) => sent.push(report) > 0) };
  };

  it("is told in the box's frame, mm, whatever was done to the world", () => {
    const { world, eyes, sent, reporter } = setting();
    eyes.immersive = true;
    world.position.set(0.2, 1, -0.5);
    world.quaternion.setFromAxisAngle(new Vector3(0, 1, 0), 0.7);
    world.scale.setScalar(12);
    const inBox = new Matrix4().compose(new Vector3(10, 20, 30), new Quaternion(0.5, 0.5, 0.5, 0.5), new Vector3(1, 1, 1));
    eyes.box.updateWorldMatrix(true, false);
    inBox.premultiply(eyes.box.matrixWorld).decompose(eyes.head.position, eyes.head.orientation, new Vector3());
    reporter.update(1000, DEFAULTS);
    expect(sent[0]!.kind).toBe("headset");
    sent[0]!.head!.position_mm.forEach((value, at) => expect(value).toBeCloseTo([10, 20, 30][at]!, 2));
    sent[0]!.head!.orientation_wxyz.forEach((value) => expect(value).toBeCloseTo(0.5, 5));
    expect(sent[0]!.world!.scale).toBe(12);
  });

  it("has the step of the guide beside the settings, told when it changes", () => {
    const { sent, reporter } = setting();
    const guide = ["", "1 of 9, Take it", "1 of 9, Take it", ""];
    guide.forEach((step, at) => reporter.update(1000 * (at + 1), DEFAULTS, step));
    expect(sent.map(({ settings }) => settings["guideStep"])).toEqual(["", "1 of 9, Take it", ""]);
    expect(sent[0]!.settings["depthMm"]).toBe(DEFAULTS.depthMm);
  });

  it("is told after changes only, and ten times a second at most", () => {
    const { camera, sent, reporter } = setting();
    for (let ms = 1000; ms < 2000; ms += 11) reporter.update(ms, DEFAULTS);
    expect(sent.length).toBe(1);
    for (let ms = 2000; ms < 3000; ms += 11) {
      camera.position.x += 0.01;
      reporter.update(ms, DEFAULTS);
    }
    expect(sent.length).toBeLessThanOrEqual(1 + 1 + 1000 / REPORT_EVERY_MS);
    expect(sent.length).toBeGreaterThan(8);
    reporter.update(4000, { ...DEFAULTS, ice: true });
    expect(sent.at(-1)!.settings["ice"]).toBe(true);
  });

  it("knows a headset's browser by its name", () => {
    expect(isHeadsetBrowser("Mozilla/5.0 (X11; Linux x86_64; Quest 3) AppleWebKit/537.36 OculusBrowser/40.1 Chrome/138 VR Safari/537.36")).toBe(true);
    expect(isHeadsetBrowser("Mozilla/5.0 (Windows NT 10.0; Win64; x64) Chrome/140 Safari/537.36")).toBe(false);
  });
});
