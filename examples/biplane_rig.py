"""Writes a rig.toml for photographs of a catheter by two calibrated webcams (jasonkglim/Catheter-Perception, MIT).

The published calibration gives each camera K, d, R and T with X_camera = R X_world + T, metres, OpenCV's order. The
world is that of a ChArUco board, so the box is put where the catheter is:

* x = 0 is where the catheter leaves its collar (or sheath): the point that both pictures show there, given as pixels.
* +x runs from the collar to the tip of the straight catheter, or any second point further along it, given the same way.
* +z points to the top camera, as far as x allows; y completes the frame, so that the front camera is on its -y side.

Both points are triangulated; how far they miss their pixels says whether the calibration fits the photographs.

    python examples/biplane_rig.py published_calibration.json rig.toml --top cam1 --front cam2 --size 1280 720 \\
        --entry 607.5 240.5 622.4 327.5 --along 607.0 474.6 621.5 533.0 --diameter 2.6
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cathxr.core import Catheter, CathxrError, DataError, FloatArray, Intrinsics, Pose, Rig, RigCamera, Roi
from cathxr.geometry import CameraModel, triangulate
from cathxr.storage.rig_file import write_rig

_MOST_OFF_ROTATION = 0.01


@dataclass(frozen=True)
class PublishedCamera:
    """One camera as published: its intrinsics, and camera_from_world in mm."""

    intrinsics: Intrinsics
    camera_from_world: Pose


def read_published(path: Path) -> dict[str, PublishedCamera]:
    """Return the cameras of a published_calibration.json by name; both of its layouts are understood.

    Raises:
        DataError: the file is missing or is no such calibration.
    """
    try:
        tables = json.loads(path.read_text(encoding="utf-8"))
        return {name: _camera(table) for name, table in tables.items() if name.startswith("cam")}
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise DataError(f"{path} is no published calibration with K, d, R and T for each camera ({error}).") from error


def _camera(table: dict[str, Any]) -> PublishedCamera:
    """Return one camera of either layout: K, d, R, T side by side, or in "intrinsics" and "extrinsics"."""
    values = {**table, **table.get("intrinsics", {}), **table.get("extrinsics", {})}
    matrix = np.array(values["K"], dtype=np.float64)
    given = np.array(values["d"], dtype=np.float64).ravel()
    distortion = np.zeros(5)
    distortion[: len(given)] = given
    rotation = np.array(values["R"], dtype=np.float64)
    left, _, right = np.linalg.svd(rotation)
    nearest = left @ right
    if np.abs(nearest - rotation).max() > _MOST_OFF_ROTATION:
        raise ValueError("R is no rotation matrix")
    return PublishedCamera(
        Intrinsics(np.array([matrix[0, 0], matrix[1, 1]]), matrix[:2, 2], distortion),
        Pose.from_matrix(nearest, 1000.0 * np.array(values["T"], dtype=np.float64).ravel()),
    )


def box_from_world(
    top: PublishedCamera, front: PublishedCamera, points_px: FloatArray, size: tuple[int, int]
) -> tuple[Pose, FloatArray]:
    """Return the box's place, and how far its two points miss their pixels (2 views, 2 points), px.

    points_px (2, 2, 2): view (top, front), point (entry, further along), u and v.
    """
    models = [CameraModel(each.intrinsics, each.camera_from_world, size) for each in (top, front)]
    found = triangulate(models, points_px)
    entry, along = found.points_box
    x = (along - entry) / np.linalg.norm(along - entry)
    to_top = models[0].centre_box - entry
    z = to_top - (to_top @ x) * x
    z /= np.linalg.norm(z)
    rotation = np.stack([x, np.cross(z, x), z])
    return Pose.from_matrix(rotation, -rotation @ entry), np.linalg.norm(found.residual_px, axis=-1)


def main() -> None:
    """Read the arguments, write the rig, and print how well the geometry fits."""
    args = _arguments()
    try:
        cameras = read_published(args.calibration)
        missing = {args.top, args.front} - set(cameras)
        if missing:
            raise DataError(f"{args.calibration} has no {' and '.join(sorted(missing))}; it has {', '.join(cameras)}.")
        top, front = cameras[args.top], cameras[args.front]
        size = (args.size[0], args.size[1])
        points_px = np.array([[args.entry[:2], args.along[:2]], [args.entry[2:], args.along[2:]]])
        placed, missed_px = box_from_world(top, front, points_px, size)
        world_from_box = placed.inverse()
        side = args.half_width
        rig = Rig(
            name=f"biplane photographs, {args.top} as top and {args.front} as front",
            roi=Roi(np.array([0.0, -side, -side]), np.array([args.length, side, side])),
            catheter=Catheter("steerable catheter in the photographs", args.diameter),
            cameras={
                name: RigCamera(name, size, 30.0, each.intrinsics, each.camera_from_world @ world_from_box)
                for name, each in (("top", top), ("front", front))
            },
        )
        write_rig(args.rig, rig)
    except (CathxrError, ValueError) as error:
        raise SystemExit(f"biplane_rig: {error}") from error
    print(f"{args.rig}: written")
    print(f"  entry misses its pixels by {missed_px[0, 0]:.2f} px (top) and {missed_px[1, 0]:.2f} px (front)")
    print(f"  the point along by {missed_px[0, 1]:.2f} px (top) and {missed_px[1, 1]:.2f} px (front)")
    for name, camera in rig.cameras.items():
        centre = CameraModel.of(camera).centre_box
        print(f"  {name} camera at {np.round(centre, 1).tolist()} mm in the box")


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    four: dict[str, Any] = {
        "type": float,
        "nargs": 4,
        "required": True,
        "metavar": ("TOP_U", "TOP_V", "FRONT_U", "FRONT_V"),
    }
    parser.add_argument("calibration", type=Path, help="published_calibration.json")
    parser.add_argument("rig", type=Path, help="the rig.toml to write")
    parser.add_argument("--top", required=True, help="the camera that becomes top, such as cam1")
    parser.add_argument("--front", required=True, help="the camera that becomes front, such as cam2")
    parser.add_argument("--size", type=int, nargs=2, default=[1280, 720], metavar=("WIDTH", "HEIGHT"))
    parser.add_argument("--entry", help="where the catheter leaves the collar, px in both pictures", **four)
    parser.add_argument("--along", help="a point further along the straight catheter, px in both pictures", **four)
    parser.add_argument("--diameter", type=float, default=3.0, help="of the catheter, mm")
    parser.add_argument("--length", type=float, default=60.0, help="of the region of interest along x, mm")
    parser.add_argument("--half-width", type=float, default=30.0, help="of the region of interest, mm")
    return parser.parse_args()


if __name__ == "__main__":
    main()
