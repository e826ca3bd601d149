"""Prints how well a tracked curve, projected back, lies on the catheter that each picture shows.

    python examples/reprojection.py rig.toml TOP FRONT [--background-top PNG --background-front PNG]

TOP and FRONT are folders of pictures or videos, as for `cathxr track`. For each pair and view: the root mean square
distance, px, of the midline measured in the picture from the projected curve, and that of the picture's own tip from
the projected tip. What lies behind the entry (x < 0) is left out: the curve ends there.
"""

import argparse
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from cathxr.app.offline import track_pairs
from cathxr.app.offline_pairs import read_pairs
from cathxr.core import Detection, FloatArray, Status
from cathxr.geometry import CameraModel, resampled
from cathxr.storage.pictures import open_pictures, read_picture
from cathxr.storage.rig_file import read_rig
from cathxr.tracking import make_tracker
from cathxr.vision import make_detector

_DENSE = 800


def distances(camera: CameraModel, detection: Detection, shape_box: FloatArray) -> tuple[float, float]:
    """Return (rms of the midline, distance of the tip), px, of a curve (K, 3) mm in `box` from what a picture shows."""
    projected = camera.project(resampled(shape_box, _DENSE))
    far, nearest = cKDTree(projected).query(detection.curve_px)
    beside = nearest < _DENSE - 1
    rms = float(np.sqrt(np.mean(np.square(far[beside]))))
    assert detection.tip_px is not None
    return rms, float(np.linalg.norm(projected[0] - detection.tip_px))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rig", type=Path)
    parser.add_argument("top", type=Path)
    parser.add_argument("front", type=Path)
    parser.add_argument("--background-top", type=Path)
    parser.add_argument("--background-front", type=Path)
    given = parser.parse_args()
    rig = read_rig(given.rig)
    backgrounds = {"top": given.background_top, "front": given.background_front}
    detectors = {
        name: make_detector("model", rig, name, background=None if path is None else read_picture(path))
        for name, path in backgrounds.items()
    }
    top, front = (open_pictures(path, rig.cameras[name]) for name, path in (("top", given.top), ("front", given.front)))
    pairs = read_pairs(top, front, rate_hz=30.0)
    for each in track_pairs(rig, pairs, detectors, make_tracker("model", rig, points=200)):
        if each.track.status is not Status.TRACKED or each.track.shape_box is None:
            print(f"pair {each.track.seq}: {each.track.status.value}, {each.track.reason}")
            continue
        for detection in each.observation.detections:
            camera = CameraModel.of(rig.cameras[detection.camera])
            rms, tip = distances(camera, detection, each.track.shape_box)
            print(f"pair {each.track.seq} {detection.camera}: midline {rms:.2f} px rms, tip {tip:.2f} px")


if __name__ == "__main__":
    main()
