"""The landmark pairs of a registration: from a file, the heart's named points, and the rig's fiducials."""

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path

import numpy as np

from cathxr.core import ConfigError, FloatArray, Marker, Rig
from cathxr.heart import HeartFolder
from cathxr.registration import LandmarkPair
from cathxr.registration.pairs_file import Measured, read_landmarks


def file_pairs(path: Path, heart: HeartFolder) -> tuple[LandmarkPair, ...]:
    """Return the pairs of a landmarks file; where it gives no place in `ct`, it is the heart's point of that name.

    Raises:
        CathxrError: the file is wrong, a place in the box is missing, or the heart knows no such point.
    """
    pairs = []
    for each in read_landmarks(path):
        if each.box_mm is None:
            raise ConfigError(
                f"{path}: the landmark {each.name} has no place in the box; add box_mm, or, for the rig's fiducials, "
                "give --fiducials with --rig."
            )
        point = each.ct_mm if each.ct_mm is not None else heart_point(heart, each.name)
        pairs.append(_pair(each, each.box_mm, point))
    return tuple(pairs)


def fiducial_pairs(rig: Rig, heart: HeartFolder, path: Path | None) -> tuple[LandmarkPair, ...]:
    """Return the rig's fiducials (mT1, mF1, ...) paired with the points of their names: of a file, or of the heart.

    Upper and lower case are the same here. How well the rig states a fiducial's place goes along.

    Raises:
        CathxrError: the rig has no fiducials, the file is wrong, or a fiducial has no point, or a point no fiducial.
    """
    markers = {each.name.lower(): each for group in rig.markers.values() for each in group}
    if not markers:
        raise ConfigError("The rig has no [markers]: add its fiducials, or register with landmarks (--pairs).")
    if path is not None:
        return tuple(_file_fiducial(path, each, markers, heart) for each in read_landmarks(path))
    points = {key.lower(): point for key, point in heart.points_ct.items()}
    known = [each for key, each in markers.items() if key in points]
    if not known:
        raise ConfigError(
            f"The heart {heart.path} has no landmarks named as the rig's fiducials "
            f"({', '.join(each.name for each in markers.values())}): add them to heart.toml in lower case, or give a "
            "file of their places in `ct` with --pairs."
        )
    return tuple(
        LandmarkPair(each.name, each.position_mm, points[each.name.lower()], box_std_mm=_std(each)) for each in known
    )


def left_out(pairs: Sequence[LandmarkPair], names: Sequence[str]) -> tuple[LandmarkPair, ...]:
    """Return the pairs without those of the names.

    Raises:
        ConfigError: there is none of a name.
    """
    for name in names:
        if name not in [each.name for each in pairs]:
            there = ", ".join(each.name for each in pairs)
            raise ConfigError(f"--leave-out {name}: there is no such landmark; there are {there}.")
    return tuple(each for each in pairs if each.name not in names)


def heart_point(heart: HeartFolder, name: str) -> FloatArray:
    """Return the heart's landmark or opening of a name, (3,) mm in `ct`.

    Raises:
        ConfigError: it has none.
    """
    points = heart.points_ct
    found = points.get(name, points.get(name.lower().replace(" ", "_")))
    if found is not None:
        return found
    near = get_close_matches(name.lower(), points, n=1)
    hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(points) or 'none'}."
    raise ConfigError(
        f"The heart {heart.path} has no landmark or opening {name!r}, and no ct_mm is given for it; {hint}"
    )


def _file_fiducial(path: Path, row: Measured, markers: dict[str, Marker], heart: HeartFolder) -> LandmarkPair:
    marker = markers.get(row.name.lower())
    if marker is None and row.box_mm is None:
        there = ", ".join(each.name for each in markers.values())
        raise ConfigError(
            f"{path}: the rig has no fiducial {row.name!r} and the file no box_mm for it; it has {there}."
        )
    point = row.ct_mm if row.ct_mm is not None else heart_point(heart, row.name)
    if row.box_mm is not None or marker is None:
        assert row.box_mm is not None
        return _pair(row, row.box_mm, point)
    pair = _pair(replace(row, name=marker.name), marker.position_mm, point)
    return pair if pair.box_std_mm is not None else replace(pair, box_std_mm=_std(marker))


def _pair(row: Measured, box_mm: FloatArray, ct_mm: FloatArray) -> LandmarkPair:
    return LandmarkPair(row.name, box_mm, ct_mm, box_std_mm=row.box_std_mm, ct_std_mm=row.ct_std_mm)


def _std(marker: Marker) -> FloatArray | None:
    """Return how well the rig states a fiducial's place, along each axis; None where it does not say."""
    stated = marker.provenance.std.get("position_mm")
    if stated is None:
        return None
    std = np.broadcast_to(np.asarray(stated, dtype=np.float64), (3,)).copy()
    return std if (std > 0).all() else None
