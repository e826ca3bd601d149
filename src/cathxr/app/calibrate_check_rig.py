"""The check of a rig with sessions and pictures of markers: reads, judges, prints, draws."""

from collections.abc import Mapping, Sequence
from datetime import date
from pathlib import Path

import click
import cv2
import numpy as np
from rich.console import Console
from rich.table import Table

from cathxr.calibration.check_drawing import check_png
from cathxr.calibration.drift import MarkerCheck, SessionCheck, check_markers, check_sessions, verdict
from cathxr.calibration.epipolar import Pairs, session_pairs
from cathxr.core import ConfigError, DataError, PixelArray, Rig
from cathxr.storage.atomic import written_whole
from cathxr.storage.rig_file import read_rig
from cathxr.storage.session import SessionReader


def check_rig(rig_path: Path, sessions: Sequence[Path], pictures: Mapping[str, Path | None], *, folder: Path) -> bool:
    """Return whether the rig is good, after printing the tables and the verdict and writing the picture.

    Raises:
        CathxrError: the check cannot be made.
    """
    rig = read_rig(rig_path)
    console = Console()
    session_check = None
    if sessions:
        session_check = check_sessions(rig, read_sessions(rig, sessions))
        _print_sessions(console, session_check)
        write_bytes(folder / "check_agreement.png", check_png(session_check, rig.roi))
    markers = [_marker_check(rig, camera, path, folder) for camera, path in pictures.items() if path is not None]
    if markers:
        _print_markers(console, markers)
    _print_ages(console, rig)
    result = verdict(session_check, markers)
    click.echo(result.sentence)
    click.echo(f"Pictures: {folder}")
    return result.good


def read_sessions(rig: Rig, folders: Sequence[Path]) -> list[tuple[str, Pairs]]:
    """Return (name, usable pairs) of each session; what its rig made of them serves for place and speed only.

    Raises:
        CathxrError: no session there, or pictures of another size than the rig's.
    """
    found = []
    for index, folder in enumerate(folders):
        reader = SessionReader(folder)
        for name, camera in rig.cameras.items():
            if reader.rig.cameras[name].size_px != camera.size_px:
                raise DataError(
                    f"{folder}: its {name} camera's pictures have {reader.rig.cameras[name].size_px} pixels and the "
                    f"rig states {camera.size_px}: give the rig that the session was recorded with."
                )
        found.append((folder.name, session_pairs(reader.rig, reader.observations(), reader.tracks(), session=index)))
    return found


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file whole, making its folder.

    Raises:
        DataError: the disk refuses.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(
            f"The folder {path.parent} cannot be made ({error.strerror}): give another --report."
        ) from error
    with written_whole(path) as part:
        part.write_bytes(data)


def _marker_check(rig: Rig, camera: str, path: Path, folder: Path) -> MarkerCheck:
    from cathxr.calibration.marker_drawing import sighting_png
    from cathxr.calibration.marker_finding import find_markers

    picture = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION)
    if picture is None:
        raise DataError(f"The picture {path} cannot be read: give a PNG or JPEG of the {camera} camera.")
    pixels: PixelArray = np.asarray(picture, dtype=np.uint8)
    size = (pixels.shape[1], pixels.shape[0])
    if size != rig.cameras[camera].size_px:
        raise ConfigError(
            f"The picture {path} has {size[0]}x{size[1]} pixels and the rig states {rig.cameras[camera].size_px} for "
            f"the {camera} camera: give an unchanged picture of that camera."
        )
    sighting = find_markers(rig, camera, pixels)
    write_bytes(folder / f"check_markers_{camera}.png", sighting_png(pixels, sighting))
    return check_markers(rig, sighting)


def _print_sessions(console: Console, check: SessionCheck) -> None:
    table = Table(title="Agreement of the two views (distance of the rays to the tip)")
    for name in ("session", "pairs", "rms mm", "rms px", "mean mm", "drift mm/min", "midline px"):
        table.add_column(name, justify="left" if name == "session" else "right")
    for row in check.sessions:
        trend = (
            "–" if not np.isfinite(row.trend_std_mm_min) else f"{row.trend_mm_min:+.3f} ± {row.trend_std_mm_min:.3f}"
        )
        table.add_row(
            row.name, str(row.pairs), f"{row.rms_mm:.3f}", f"{row.rms_px:.2f}",
            f"{row.mean_mm:+.3f} ± {row.mean_std_mm:.3f}", trend, "/".join(f"{each:.2f}" for each in row.shape_px),
        )  # fmt: skip
    console.print(table)
    regions = Table(title="By region (z: mean over what the rig's stated errors let expect)")
    for name in ("region", "places", "mean mm", "rms mm", "expected mm", "z"):
        regions.add_column(name, justify="left" if name == "region" else "right")
    for each in check.regions:
        regions.add_row(
            each.name, str(each.cells), f"{each.mean_mm:+.3f}", f"{each.rms_mm:.3f}", f"{each.expected_mm:.3f}",
            f"{each.z:+.1f}",
        )  # fmt: skip
    console.print(regions)
    delay, std = check.judgement.delay_s
    told = ", ".join(f"{name} {share:.0%}" for name, share in check.judgement.probability.items())
    console.print(
        f"Entry at y {check.entry_mm[0]:+.2f}, z {check.entry_mm[1]:+.2f} mm. Cameras {1e3 * delay:+.1f} ± "
        f"{1e3 * std:.1f} ms apart. Which camera moved: {told}. If believed, the tip is off by "
        f"{check.tip_shift_mm:.2f} mm.",
        highlight=False,
    )


def _print_markers(console: Console, markers: Sequence[MarkerCheck]) -> None:
    table = Table(title="Markers against the rig's poses")
    for name in ("camera", "markers", "rms px", "rms px refitted", "moved mm", "turned °", "tip mm", "p"):
        table.add_column(name, justify="left" if name == "camera" else "right")
    for each in markers:
        table.add_row(
            each.camera, str(len(each.names)), f"{each.rms_px:.2f}", f"{each.rms_after_px:.2f}", f"{each.moved_mm:.2f}",
            f"{each.turned_deg:.3f}", f"{each.tip_shift_mm:.2f}", f"{each.p_value:.2g}",
        )  # fmt: skip
    console.print(table)


def _print_ages(console: Console, rig: Rig) -> None:
    for name, camera in rig.cameras.items():
        stated = camera.pose_provenance
        parts = [f"{name} camera's pose: "]
        if stated.date is None:
            parts.append("the rig states no date")
        else:
            try:
                days = (date.today() - date.fromisoformat(stated.date[:10])).days
                parts.append(f"calibrated on {stated.date}, {days} days ago")
            except ValueError:
                parts.append(f"calibrated on {stated.date}")
        if stated.rms_px is not None:
            parts.append(f" at {stated.rms_px:.2f} px")
        console.print("".join(parts) + ".", highlight=False)
