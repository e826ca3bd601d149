"""Prints how far a point reconstructed from two cameras misses what a third camera, which was not used, shows.

The point is the tip of one row of track.csv, or three numbers, mm in `box`. What the third camera shows is given as a
pixel, or found in its picture: the middle of the catheter seen nearest to the point. A camera that looks along the
catheter shows the tip as a disc, and that disc's middle is where the centreline's end appears.

    python examples/third_camera.py published_calibration.json rig.toml --top cam1 --third cam0 \\
        --track track.csv --seen 606.3 399.7
"""

import argparse
import csv
from pathlib import Path

import cv2
import numpy as np
from biplane_rig import PublishedCamera, read_published

from cathxr.core import CathxrError, DataError, FloatArray, Pose, Rig
from cathxr.geometry import CameraModel
from cathxr.storage.rig_file import read_rig
from cathxr.vision.segment_background import BackgroundSegmenter
from cathxr.vision.segment_colour import ColourSegmenter
from cathxr.vision.segmentation import Window


def third_camera(rig: Rig, top: PublishedCamera, third: PublishedCamera) -> CameraModel:
    """Return the third camera in the rig's box: the rig's top camera tells where the published world lies in it."""
    world_from_box: Pose = top.camera_from_world.inverse() @ rig.cameras["top"].camera_from_box
    return CameraModel(third.intrinsics, third.camera_from_world @ world_from_box, rig.cameras["top"].size_px)


def tip_of_row(path: Path, row: int) -> FloatArray:
    """Return the tip (3,), mm in `box`, of a row of track.csv.

    Raises:
        DataError: no such row, or no catheter was tracked in it.
    """
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    if not 0 <= row < len(rows):
        raise DataError(f"{path} has {len(rows)} rows; row {row} is not one of them.")
    values = [rows[row][f"tip_{axis}_mm"] for axis in "xyz"]
    if not all(values):
        raise DataError(f"{path}, row {row}: the catheter was lost ({rows[row]['reason']}), so it has no tip.")
    return np.array([float(each) for each in values])


def seen_in_picture(picture: Path, background: Path | None, near_px: FloatArray, *, radius_px: int = 60) -> FloatArray:
    """Return the middle (2,), px, of what is seen nearest to a pixel, weighted by how much of each pixel it covers.

    Raises:
        DataError: a picture cannot be read, or nothing is seen near the pixel.
    """
    pixels = _picture(picture)
    segmenter = ColourSegmenter() if background is None else BackgroundSegmenter(_picture(background))
    segmenter.coarse(pixels)
    height, width = pixels.shape[:2]
    x, y = (round(float(each)) for each in near_px)
    window = Window(max(0, x - radius_px), max(0, y - radius_px), min(width, x + radius_px), min(height, y + radius_px))
    if window.x1 <= window.x0 or window.y1 <= window.y0:
        raise DataError(f"The point falls outside {picture}, at pixel ({x}, {y}).")
    matte = segmenter.matte(pixels, window)
    count, labels, _, centres = cv2.connectedComponentsWithStats((matte > 0.5).astype(np.uint8))
    large = [each for each in range(1, count) if (labels == each).sum() >= 20]
    if not large:
        raise DataError(f"{picture} shows no catheter within {radius_px} px of ({x}, {y}).")
    corner = np.array([window.x0, window.y0])
    nearest = min(large, key=lambda each: float(np.linalg.norm(centres[each] + corner - near_px)))
    rows, columns = np.nonzero(labels == nearest)
    weight = matte[rows, columns]
    return np.asarray(np.array([columns @ weight, rows @ weight]) / weight.sum() + corner, dtype=np.float64)


def _picture(path: Path) -> np.ndarray:
    pixels = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if pixels is None:
        raise DataError(f"{path} cannot be read as a picture.")
    return pixels


def main() -> None:
    """Read the arguments and print the error in the third camera."""
    args = _arguments()
    try:
        cameras = read_published(args.calibration)
        missing = {args.top, args.third} - set(cameras)
        if missing:
            raise DataError(f"{args.calibration} has no {' and '.join(sorted(missing))}; it has {', '.join(cameras)}.")
        model = third_camera(read_rig(args.rig), cameras[args.top], cameras[args.third])
        point = np.array(args.point) if args.point else tip_of_row(args.track, args.row)
        expected, slope = model.project_with_jacobian(point[None])
        seen = np.array(args.seen) if args.seen else seen_in_picture(args.picture, args.background, expected[0])
    except (CathxrError, ValueError) as error:
        raise SystemExit(f"third_camera: {error}") from error
    error_px = float(np.linalg.norm(expected[0] - seen))
    px_per_mm = float(np.sqrt(np.linalg.norm(slope[0]) ** 2 / 2.0))
    print(f"the point {_text(point)} mm in the box should appear at {_text(expected[0])} px")
    print(f"it is seen at {_text(seen)} px: {error_px:.2f} px apart, {error_px / px_per_mm:.2f} mm at that distance")


def _text(values: FloatArray) -> str:
    return "(" + ", ".join(f"{each:.2f}" for each in values) + ")"


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("calibration", type=Path, help="published_calibration.json")
    parser.add_argument("rig", type=Path, help="the rig.toml made by biplane_rig.py")
    parser.add_argument("--top", required=True, help="the published camera that the rig calls top")
    parser.add_argument("--third", required=True, help="the published camera that was not used")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--track", type=Path, help="a track.csv")
    what.add_argument("--point", type=float, nargs=3, metavar=("X", "Y", "Z"), help="mm in the box")
    parser.add_argument("--row", type=int, default=0, help="which row of track.csv")
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--seen", type=float, nargs=2, metavar=("U", "V"), help="where the third camera shows it, px")
    where.add_argument("--picture", type=Path, help="the third camera's picture")
    parser.add_argument("--background", type=Path, help="the third camera's picture of the empty box")
    return parser.parse_args()


if __name__ == "__main__":
    main()
