"""Makes the pictures of a simulated box that nobody has measured yet, and prints the commands that measure it.

The box's cameras and lenses are off their drawing by an amount that only the seed knows. What is written is what a lab
would have: the drawing as a rig, pictures of a board before each camera, a picture of the fiducials from each camera,
and a catheter moved about. The exact tips are written beside them, to compare with at the end.

    python examples/calibrate_from_scratch.py box --seed 3
    sh box/commands.sh          # or type what it printed
    python examples/calibrate_from_scratch.py box --compare
"""

import argparse
import csv
import dataclasses
import json
import zlib
from pathlib import Path

import cv2
import numpy as np

from cathxr.calibration.board import Board, parse_board
from cathxr.core import FloatArray, Intrinsics, PixelArray, Pose, Rig, RigCamera
from cathxr.geometry.pose import pose_from_vector
from cathxr.storage.rig_file import example_rig, write_rig
from cathxr.twin import CameraRenderer, TwinWorld, scene, true_rig
from cathxr.twin.board_pictures import BoardRenderer

BOARD = "charuco:10x10:10.0:7.0:DICT_4X4_50"
VIEWS = 16
PAIRS = 150
RATE_HZ = 10.0
MANOEUVRES = ("full_range", "flexion", "smooth")
_PX_PER_MM = 16.0
_MARGIN_MM = 8.0


def unknown_box(nominal: Rig, seed: int) -> Rig:
    """Return the box as it really is: cameras moved, lenses not quite what their maker says."""
    moved = true_rig(nominal, seed)
    return dataclasses.replace(moved, cameras={name: _with_lens(each, seed) for name, each in moved.cameras.items()})


def _with_lens(camera: RigCamera, seed: int) -> RigCamera:
    rng = np.random.default_rng([seed, zlib.crc32(camera.name.encode()), 0x1E45])
    nominal = camera.intrinsics
    lens = Intrinsics(
        nominal.focal_px * (1.0 + rng.uniform(-0.03, 0.03)) * np.array([1.0, 1.0 + rng.uniform(-0.001, 0.001)]),
        nominal.centre_px + rng.uniform(-12.0, 12.0, size=2),
        nominal.distortion + rng.uniform(-1.0, 1.0, size=5) * [0.03, 0.03, 5e-4, 5e-4, 0.0],
    )
    return dataclasses.replace(camera, intrinsics=lens)


def board_poses(board: Board, rng: np.random.Generator, *, count: int, camera: RigCamera) -> list[Pose]:
    """Return camera_from_board of a board held before a camera: all over the picture, tilted to all sides."""
    corners = board.corners_mm
    middle, extent = 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.ptp(corners, axis=0)[:2].max()
    poses = []
    for index in range(count):
        tilt = np.deg2rad(rng.uniform(12.0, 38.0)) if index % 4 else 0.0
        way = 2.0 * np.pi * index / 7.0 + rng.uniform(-0.3, 0.3)
        turn = pose_from_vector(np.array([tilt * np.cos(way), tilt * np.sin(way), 0.0, 0.0, 0.0, 0.0]))
        spin = pose_from_vector(np.array([0.0, 0.0, rng.uniform(-0.4, 0.4), 0.0, 0.0, 0.0]))
        depth = 1.35 * extent * camera.intrinsics.focal_px[0] / min(camera.size_px) * rng.uniform(0.95, 1.5)
        room = np.maximum(np.array(camera.size_px) / camera.intrinsics.focal_px * depth - 0.9 * extent, 0.0)
        shift = 0.5 * room * rng.uniform(-1.0, 1.0, size=2)
        rotation = turn @ spin
        poses.append(Pose(rotation.rotation_wxyz, np.array([*shift, depth]) - rotation.rotation @ middle))
    return poses


def write_boards(folder: Path, board: Board, rig: Rig, *, seed: int, views: int) -> None:
    """Write the board pictures of each camera into folder/boards/<camera>."""
    texture = board.picture(px_per_mm=_PX_PER_MM, margin_mm=_MARGIN_MM)
    for name, camera in rig.cameras.items():
        rng = np.random.default_rng([seed, zlib.crc32(name.encode()), 0xB0A2D])
        renderer = BoardRenderer(
            camera,
            texture,
            px_per_mm=_PX_PER_MM,
            offset_mm=(_MARGIN_MM, _MARGIN_MM),
            settings=scene("empty_wall"),
            seed=seed,
        )
        for index, pose in enumerate(board_poses(board, rng, count=views, camera=camera)):
            _write(folder / "boards" / name / f"{index:02d}.png", renderer.picture(pose, number=index))


def write_catheter(folder: Path, rig: Rig, *, seed: int, pairs: int) -> None:
    """Write the picture pairs of a moving catheter, and the exact tips, which the commands never see."""
    rows = [("seq", "x_mm", "y_mm", "z_mm")]
    for part, manoeuvre in enumerate(MANOEUVRES):
        settings = dataclasses.replace(scene("smooth"), manoeuvre=manoeuvre)
        world = TwinWorld(rig, seed=seed, settings=settings)
        renderers = {name: CameraRenderer(world, name) for name in rig.cameras}
        for index in range(pairs // len(MANOEUVRES)):
            # However many: over the same stretch of the manoeuvre.
            seq, t_ns = part * (pairs // len(MANOEUVRES)) + index, round(index * PAIRS / pairs * 1e9 / RATE_HZ)
            for name, renderer in renderers.items():
                _write(folder / "catheter" / name / f"{seq:04d}.png", renderer.picture(t_ns))
            rows.append((str(seq), *(f"{each:.4f}" for each in world.state(t_ns).shape_box[0])))
    with (folder / "true_tips.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows(rows)


def commands(folder: Path, seed: int) -> str:
    """Return the commands that measure the box and track the catheter in it."""
    rig = folder / "rig.toml"
    lines = [f"# the box of seed {seed}"]
    for name in ("top", "front"):
        pictures = folder / "boards" / name
        lines.append(f"cathxr calibrate intrinsics --rig {rig} --camera {name} --board {BOARD} {pictures}")
    top, front = folder / "markers" / "top.png", folder / "markers" / "front.png"
    lines.append(f"cathxr calibrate markers --rig {rig} --top {top} --front {front}")
    catheter = folder / "catheter"
    lines.append(
        f"cathxr track --rig {rig} --top {catheter / 'top'} --front {catheter / 'front'} --out {folder / 'track.csv'}"
    )
    return "\n".join(lines) + "\n"


def compare(folder: Path) -> tuple[FloatArray, int]:
    """Return the distances (N,), mm, of the tracked tips from the true ones, and how many pairs were lost."""
    true, found = (_tips(folder / name, column) for name, column in (("true_tips.csv", ""), ("track.csv", "tip_")))
    errors = np.array([np.linalg.norm(found[seq] - true[seq]) for seq in true if seq in found])
    return errors, len(true) - len(errors)


def _tips(path: Path, column: str) -> dict[int, FloatArray]:
    with path.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row[f"{column}x_mm"]]
    return {int(row["seq"]): np.array([float(row[f"{column}{axis}_mm"]) for axis in "xyz"]) for row in rows}


def make(folder: Path, seed: int, *, views: int = VIEWS, pairs: int = PAIRS) -> None:
    """Write everything."""
    nominal = example_rig()
    rig = unknown_box(nominal, seed)
    folder.mkdir(parents=True, exist_ok=True)
    write_rig(folder / "rig.toml", nominal)
    write_boards(folder, parse_board(BOARD), rig, seed=seed, views=views)
    world = TwinWorld(rig, seed=seed, settings=scene("pillars"))
    for name in rig.cameras:
        _write(folder / "markers" / f"{name}.png", CameraRenderer(world, name).picture(0))
    write_catheter(folder, rig, seed=seed, pairs=pairs)
    (folder / "commands.sh").write_text(commands(folder, seed), encoding="utf-8")


def _write(path: Path, pixels: PixelArray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    if not cv2.imwrite(str(path), pixels):
        raise SystemExit(f"{path} cannot be written.")


def main() -> None:
    """Run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--views", type=int, default=VIEWS, help="Pictures of the board before each camera.")
    parser.add_argument("--pairs", type=int, default=PAIRS, help="Picture pairs of the catheter.")
    parser.add_argument("--compare", action="store_true", help="Compare the tracked tips with the true ones.")
    parser.add_argument("--json", action="store_true", help="With --compare: print the figures as JSON.")
    given = parser.parse_args()
    if not given.compare:
        make(given.folder, given.seed, views=given.views, pairs=given.pairs)
        print(commands(given.folder, given.seed), end="")
        return
    errors, lost = compare(given.folder)
    mean, p95, most = errors.mean(), np.percentile(errors, 95), errors.max()
    if given.json:
        print(json.dumps({"mean_mm": mean, "p95_mm": p95, "max_mm": most, "tracked": len(errors), "lost": lost}))
        return
    print(f"tip error: mean {mean:.3f} mm, p95 {p95:.3f} mm, max {most:.3f} mm; {len(errors)} tracked, {lost} lost")


if __name__ == "__main__":
    main()
