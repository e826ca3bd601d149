"""`cathxr calibrate markers --click`: a person sees what was found of the fiducials and places what was not."""

import datetime
from collections.abc import Mapping, Sequence
from pathlib import Path

import click
import numpy as np

from cathxr.app.calibrate_markers_report import judgement
from cathxr.app.calibration_server import serve_calibration
from cathxr.app.page_options import PageChoice
from cathxr.calibration.error_map import error_summary
from cathxr.calibration.marker_drawing import sighting_png
from cathxr.calibration.poses import PosesResult
from cathxr.calibration.poses_drawing import error_map_png, residuals_png
from cathxr.calibration.sighting import Sighting
from cathxr.core import ConfigError, DataError, Image, PixelArray, Rig
from cathxr.devices.clock import MonotonicClock
from cathxr.runtime.calibration_markers import MarkersSession
from cathxr.runtime.calibration_task import Ending
from cathxr.storage.atomic import check_writable, os_reason, written_whole
from cathxr.storage.rig_file import read_rig, rig_to_text, write_rig
from cathxr.wire.hub import Hub


def calibrate_markers_click(
    rig_path: Path,
    pictures: Mapping[str, Sequence[PixelArray]],
    *,
    report: Path,
    dry_run: bool,
    page: PageChoice,
) -> None:
    """Measure the poses on the page and write them into the rig; returns when a person has accepted them.

    pictures: by camera, one or several from the same place, with one cross in or both.

    Raises:
        CathxrError: it could not start, or was cancelled: the rig is untouched.
    """
    rig = read_rig(rig_path)
    unknown = sorted(set(pictures) - set(rig.cameras))
    if unknown or not pictures or not all(pictures.values()):
        raise ConfigError(f"Give pictures of {' and '.join(rig.cameras)}, with the crosses in them.")
    if not dry_run:
        check_writable(rig_path, what="the rig")
    clock = MonotonicClock()
    stills = tuple(Image(name, 0, clock.now_ns(), blended(each)) for name, each in pictures.items())

    def save(result: PosesResult, sightings: Mapping[str, Sighting]) -> Ending:
        return save_poses(rig_path, rig, result, sightings, pictures, report=report, dry_run=dry_run)

    def task(hub: Hub) -> MarkersSession:
        date = datetime.date.today().isoformat()
        return MarkersSession(rig, pictures, date=date, judge=judgement, keep=hub.publish_result, save=save)

    ending = serve_calibration(
        task,
        {},
        rig=rig,
        kind="pictures",
        title="Placing the fiducials by hand.",
        clock=clock,
        page=page,
        stills=stills,
    )
    click.echo(ending.sentence)


def blended(pictures: Sequence[PixelArray]) -> PixelArray:
    """Return one picture, (H, W, 3) BGR, that shows what is colourful in any of several from the same place.

    So that crosses which were in one at a time are all seen.
    """
    if len(pictures) == 1:
        return pictures[0]
    stack = np.stack([np.repeat(each[:, :, None], 3, axis=2) if each.ndim == 2 else each for each in pictures])
    best = np.argmax(np.ptp(stack, axis=3), axis=0)
    return np.ascontiguousarray(np.take_along_axis(stack, best[None, :, :, None], axis=0)[0])


def save_poses(
    rig_path: Path,
    rig: Rig,
    result: PosesResult,
    sightings: Mapping[str, Sighting],
    pictures: Mapping[str, Sequence[PixelArray]],
    *,
    report: Path,
    dry_run: bool,
) -> Ending:
    """Write the report's pictures and last the rig; return how it ended. rig: what the file held at the start.

    Raises:
        CathxrError: something cannot be written; the rig is untouched.
    """
    try:
        report.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"{report}: cannot make the report's folder ({os_reason(error)}); choose another.") from error
    drawn = {f"markers_{name}": sighting_png(blended(pictures[name]), each) for name, each in sightings.items()}
    drawn |= {"expected_error": error_map_png(result.rig), "markers_residuals": residuals_png(result)}
    paths = []
    for name, png in drawn.items():
        with written_whole(report / f"{name}.png") as part:
            part.write_bytes(png)
        paths.append(str(report / f"{name}.png"))
    expected = f"an error of {error_summary(result.rig).mean_mm:.3f} mm is to be expected"
    if dry_run:
        return Ending(f"Nothing was written into {rig_path} (--dry-run): {expected}.", True, tuple(paths))
    if rig_to_text(read_rig(rig_path)) != rig_to_text(rig):
        raise ConfigError(f"{rig_path} was changed while the fiducials were placed: start again from what it says now.")
    write_rig(rig_path, result.rig, backup=True)
    sentence = f"The poses are in {rig_path} (the earlier file is beside it): {expected}."
    return Ending(sentence, True, (str(rig_path), *paths))
