import { Matrix4, Vector3, Vector4 } from "three";
import { describe, expect, it } from "vitest";
import {
  ARM_PRESETS, ArmAxes, armText, BIPLANES, FIELD_MM, MAGNIFICATION, paired, pictureFromCt, sideLetters, SOURCE_DETECTOR_MM, SOURCE_ISOCENTRE_MM,
} from "../src/fluoro/arms";
import { SettingsStore } from "../src/stage/settings";
import { presetAt } from "../src/fluoro/overlay";
import { attenuationTable, BONE_PER_MM, impedanceOf, LUNG_PER_MM, summarise } from "../src/fluoro/tissue";

const axes = (laoDeg: number, cranialDeg: number): ArmAxes => new ArmAxes().set({ laoDeg, cranialDeg });
const close = (found: Vector3, expected: readonly number[]): void =>
  found.toArray().forEach((value, at) => expect(value).toBeCloseTo(expected[at]!, 9));

describe("arms, in LPS (x to the patient's left, y posterior, z to the head)", () => {
  it("AP: from behind to the detector in front, the patient's left on the right, the head on top", () => {
    const arm = axes(0, 0);
    close(arm.beam, [0, -1, 0]);
    close(arm.right, [1, 0, 0]);
    close(arm.up, [0, 0, 1]);
  });

  it("LAO 90 is a lateral: the detector on the patient's left, the front on the left of the picture", () => {
    const arm = axes(90, 0);
    close(arm.beam, [1, 0, 0]);
    close(arm.right, [0, 1, 0]);
    close(arm.up, [0, 0, 1]);
  });

  it("RAO 90: the detector on the patient's right", () => close(axes(-90, 0).beam, [-1, 0, 0]));

  it("PA: the detector behind the patient", () => close(axes(180, 0).beam, [0, 1, 0]));

  it("cranial 90: the detector above the head, caudal 90: below the feet", () => {
    close(axes(0, 90).beam, [0, 0, 1]);
    close(axes(0, -90).beam, [0, 0, -1]);
    close(axes(0, 90).up, [0, 1, 0]); // the patient's front has turned to the bottom of the picture
  });

  it("RAO 30 CAU 20: to the right, to the front and down", () => {
    const { beam } = axes(-30, -20);
    close(beam, [-Math.sin(Math.PI / 6) * Math.cos(Math.PI / 9), -Math.cos(Math.PI / 6) * Math.cos(Math.PI / 9), -Math.sin(Math.PI / 9)]);
  });

  it("keeps its axes orthonormal, seen from the detector's side", () => {
    for (let lao = -180; lao <= 180; lao += 30) for (let cranial = -60; cranial <= 60; cranial += 20) {
      const { beam, right, up } = axes(lao, cranial);
      close(new Vector3().crossVectors(right, up), beam.toArray());
      expect(right.dot(up)).toBeCloseTo(0, 12);
    }
  });

  it("writes angles and sides as a cath lab does", () => {
    expect(armText({ laoDeg: -30, cranialDeg: -20 })).toBe("RAO 30  CAU 20");
    expect(armText({ laoDeg: 45, cranialDeg: 0 })).toBe("LAO 45  CRA 0");
    expect(sideLetters(axes(0, 0).right)).toBe("L");
    expect(sideLetters(axes(45, 0).right)).toBe("LP");
    expect(sideLetters(axes(90, 0).right)).toBe("P");
    expect(sideLetters(axes(10, 5).up)).toBe("H");
    expect(ARM_PRESETS.map(({ name }) => name)).toEqual(["AP", "RAO 30", "LAO 45", "LAO 60", "Lateral", "RAO 30 CAU 20", "LAO 45 CRA 20"]);
  });
});

describe("the picture", () => {
  const isocentre = new Vector3(57, 55, 64);
  const place = (matrix: Matrix4, point: Vector3): [number, number, number] => {
    const seen = new Vector4(point.x, point.y, point.z, 1).applyMatrix4(matrix);
    return [seen.x / seen.w, seen.y / seen.w, seen.w];
  };

  it("has the isocentre in its middle, and magnifies what is there by distance over distance", () => {
    for (const { angles } of ARM_PRESETS) {
      const arm = new ArmAxes().set(angles);
      const matrix = pictureFromCt(new Matrix4(), arm, isocentre);
      const [x, y, away] = place(matrix, isocentre);
      expect(x).toBeCloseTo(0, 9);
      expect(y).toBeCloseTo(0, 9);
      expect(away).toBeCloseTo(SOURCE_ISOCENTRE_MM, 9);
      const [right] = place(matrix, isocentre.clone().addScaledVector(arm.right, FIELD_MM / 2));
      expect(right).toBeCloseTo(1, 9);
      const [, top] = place(matrix, isocentre.clone().addScaledVector(arm.up, -FIELD_MM / 4));
      expect(top).toBeCloseTo(-0.5, 9);
    }
    expect(MAGNIFICATION).toBeCloseTo(SOURCE_DETECTOR_MM / SOURCE_ISOCENTRE_MM, 12);
  });

  it("shows what is nearer to the focal spot larger", () => {
    const arm = axes(0, 0);
    const matrix = pictureFromCt(new Matrix4(), arm, isocentre);
    const [behind] = place(matrix, isocentre.clone().add(new Vector3(20, 50, 0)));
    const [before] = place(matrix, isocentre.clone().add(new Vector3(20, -50, 0)));
    expect(behind / before).toBeCloseTo((SOURCE_ISOCENTRE_MM + 50) / (SOURCE_ISOCENTRE_MM - 50), 9);
  });

  it("has the spine on the left in RAO, on the right in LAO", () => {
    const spine = isocentre.clone().add(new Vector3(-19, 75, 0));
    expect(place(pictureFromCt(new Matrix4(), axes(-30, 0), isocentre), spine)[0]).toBeLessThan(-0.5);
    expect(place(pictureFromCt(new Matrix4(), axes(45, 0), isocentre), spine)[0]).toBeGreaterThan(0.4);
  });
});

describe("tissue", () => {
  it("weakens more the denser it is, from lung to bone", () => {
    const table = attenuationTable();
    expect(impedanceOf(0)).toBeCloseTo(0.37, 1);
    expect(impedanceOf(255)).toBeCloseTo(6.7, 0);
    expect(table[0]).toBeCloseTo(LUNG_PER_MM, 3);
    expect(table[255]).toBeCloseTo(BONE_PER_MM, 3);
    for (let code = 1; code < 256; code++) expect(table[code]! - table[code - 1]!).toBeGreaterThanOrEqual(-1e-9);
  });

  it("finds the blood, and bone where there is some", () => {
    const size = [12, 10, 8] as const;
    const rgba = new Uint8Array(4 * 12 * 10 * 8);
    for (let at = 0; at < rgba.length; at += 4) rgba.set([130, 160, 0, 0], at); // muscle
    const fill = (i0: number, i1: number, codes: readonly number[]): void => {
      for (let k = 2; k < 6; k++) for (let j = 4; j < 8; j++) for (let i = i0; i < i1; i++) rgba.set(codes, 4 * (i + 12 * (j + 10 * k)));
    };
    fill(4, 8, [127, 38, 0, 0]);
    const ctFromVoxel = new Matrix4().makeTranslation(100, 200, 300).multiply(new Matrix4().makeScale(2, 2, 2)).elements;
    const summary = summarise(rgba, size, ctFromVoxel);
    // voxels 4 and 6, 4 and 6, 2 and 4 are looked at
    expect(summary.centre).toEqual([110, 210, 306]);
    expect(summary.hasBone).toBe(false);
    fill(0, 2, [240, 90, 0, 0]);
    expect(summarise(rgba, size, ctFromVoxel).hasBone).toBe(true);
  });
});

describe("pairs of views", () => {
  const store = (): SettingsStore => {
    const made = new SettingsStore();
    made.listen((now, before) => {
      const change = paired(now, before);
      if (change !== null) made.set(change);
    });
    return made;
  };

  it("turn both arms, and are left when an arm is turned", () => {
    const settings = store();
    settings.set({ biplane: "oblique" });
    expect(settings.value.arms).toEqual(BIPLANES.oblique);
    settings.set({ arms: [{ laoDeg: -29, cranialDeg: 0 }, { laoDeg: 45, cranialDeg: 0 }] });
    expect(settings.value.biplane).toBe("own");
    expect(settings.value.arms[0].laoDeg).toBe(-29);
    settings.set({ biplane: "ap" });
    expect(settings.value.arms).toEqual(BIPLANES.ap);
  });

  it("do nothing to arms that are locked", () => {
    const settings = store();
    settings.hold({ values: { arms: [{ laoDeg: 10, cranialDeg: 5 }, { laoDeg: 80, cranialDeg: 0 }] }, sentence: "Held." });
    settings.set({ biplane: "oblique" });
    expect(settings.value.arms[0]).toEqual({ laoDeg: 10, cranialDeg: 5 });
  });
});

describe("the presets on a picture in a headset", () => {
  it("are where they are drawn, from the left in their order, and nowhere else", () => {
    const row = (52 + 17) / (640 / 1.8); // in the middle of the row
    const found = ARM_PRESETS.map((_, at) => presetAt((10 + ((at + 0.5) * (640 / 1.8 - 20)) / ARM_PRESETS.length) / (640 / 1.8), row, 1.8));
    expect(found).toEqual(ARM_PRESETS);
    expect(presetAt(0.5, 0.5, 1.8)).toBeNull();
    expect(presetAt(0.5, 0.02, 1.8)).toBeNull();
    expect(presetAt(0.001, row, 1.8)).toBeNull();
    expect(presetAt(0.999, row, 1.8)).toBeNull();
  });
});
