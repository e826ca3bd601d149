"""What scoring needs beside a recording: the heart, where the box lies in it, its walls, an expert's path."""

import importlib.util
from pathlib import Path

import numpy as np

from cathxr.app.heart_registration import registration_of
from cathxr.app.register_heart import chosen_heart
from cathxr.core import ConfigError, FloatArray, Roi, Track
from cathxr.heart import HeartFolder
from cathxr.heart.wall_field import BoxDepth, wall_field
from cathxr.registration import Registration, registration_from_table
from cathxr.storage.session import SessionReader
from cathxr.training import PlacedTask, Task, place_task, task_sha256
from cathxr.training.metrics import Depth, motion_of
from cathxr.training.metrics.curves import path_points
from cathxr.training.metrics.motion import smoothed


def recorded_registration(session: SessionReader, heart: HeartFolder) -> Registration:
    """Return the registration that a session was recorded with, else the heart's."""
    if session.registration is None:
        return registration_of(heart)
    return registration_from_table(session.registration, name=f"{session.folder}: registration")


def placed_in(task: Task, heart: Path | None, roi: Roi, registration: Registration | None = None) -> PlacedTask:
    """Return a task placed by a heart's landmarks. heart: its folder, None for the built-in one.

    Raises:
        CathxrError: the heart cannot be read, or the task does not fit it.
    """
    folder = chosen_heart(heart)
    found = registration_of(folder) if registration is None else registration
    return place_task(task, ct_from_box=found.matrix, points_ct=folder.points_ct, roi=roi, sha256=task_sha256(task))


def wall_depth(heart: HeartFolder, registration: Registration) -> Depth | None:
    """Return how deep points of `box` are in the heart's wall; None without labels, or the libraries to read them."""
    if heart.labels is None or importlib.util.find_spec("SimpleITK") is None:
        return None
    from cathxr.heart.acoustic import leads_out
    from cathxr.heart.reading import read_labels

    labels = read_labels(heart.labels, like=None)
    vessels = [opening for key, opening in heart.openings.items() if leads_out(key, labels)]
    return BoxDepth(wall_field(labels, vessels=vessels), registration.matrix)


def expert_path(folder: Path) -> FloatArray:
    """Return the path (N, 3) mm of the tip over a whole recording, which holds an expert's run and nothing else.

    Raises:
        CathxrError: it cannot be read, or the tip hardly moves in it.
    """
    tracks = tuple(SessionReader(folder).tracks())
    points = path_points(smoothed(motion_of(tracks, _whole(tracks))))
    if len(points) == 0:
        raise ConfigError(f"{folder}: the tip moves less than 1 mm in this recording; give an expert's run.")
    return np.asarray(points)


def _whole(tracks: tuple[Track, ...]) -> tuple[tuple[int, int], ...]:
    return ((tracks[0].t_ns, tracks[-1].t_ns),) if tracks else ()
