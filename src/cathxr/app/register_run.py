"""The ways to register, put together: reads, solves, prints, writes."""

from dataclasses import dataclass
from pathlib import Path

import click

from cathxr.app.page_options import PageChoice
from cathxr.app.register_heart import chosen_heart, chosen_out, far_outside, heart_shape
from cathxr.app.register_inputs import fiducial_pairs, file_pairs, heart_point, left_out
from cathxr.app.register_report import print_solution, write_picture, write_registration_file
from cathxr.core import RegistrationError
from cathxr.registration import Kind, default_placement, register
from cathxr.storage.rig_file import read_rig


@dataclass(frozen=True)
class FileChoice:
    """What a person chose for landmarks from files. rig: whose fiducials are the landmarks; None: those of the file."""

    pairs: Path | None
    rig: Path | None
    kind: str
    date: str
    fle_mm: float | None = None
    leave_out: tuple[str, ...] = ()
    out: Path | None = None
    report: Path | None = None
    dry_run: bool = False
    yes: bool = False


@dataclass(frozen=True)
class TouchChoice:
    """What a person chose for touching. wanted: the landmarks' names, none: all of the heart that can be reached."""

    rig: Path | None
    kind: str
    source: str
    date: str
    page: PageChoice
    wanted: tuple[str, ...] = ()
    config: Path | None = None
    seed: int = 0
    out: Path | None = None
    report: Path | None = None
    dry_run: bool = False


def register_file(heart_path: Path | None, choice: FileChoice) -> None:
    """Register with landmarks from files.

    Raises:
        CathxrError: there is no registration, or one in grave doubt; nothing was written.
    """
    heart = chosen_heart(heart_path)
    target = None if choice.dry_run else chosen_out(heart, choice.out)
    if choice.rig is not None:
        pairs = fiducial_pairs(read_rig(choice.rig), heart, choice.pairs)
        method = "fiducials of the rig found in the heart's model"
    else:
        assert choice.pairs is not None
        pairs, method = file_pairs(choice.pairs, heart), "landmarks from a file"
    shape = heart_shape(heart)
    solution = register(
        left_out(pairs, choice.leave_out),
        Kind(choice.kind),
        method=method,
        date=choice.date,
        fle_mm=choice.fle_mm,
        heart_ct=shape.vertices_ct,
    )
    print_solution(solution, shape)
    for each in solution.registration.landmarks:
        if told := far_outside(shape, each.name, each.ct_mm):
            click.echo(f"Note: {told}")
    if solution.is_grave and not choice.yes:
        grave = " ".join(each.sentence for each in solution.doubts if each.grave)
        raise RegistrationError(f"Nothing was written: {grave} (--yes writes it all the same.)")
    if target is None:
        click.echo("Nothing was written (--dry-run).")
        return
    click.echo(write_picture(choice.report or target.with_name(f"{target.stem}_report"), solution, shape))
    click.echo(write_registration_file(target, solution.registration))


def place(
    heart_path: Path | None, *, out: Path | None, inlet: str, towards: str, before_mm: float, date: str, dry_run: bool
) -> None:
    """Write the placement that measures nothing: the inlet before one opening, the axis towards another.

    Raises:
        CathxrError: the heart lacks the openings, or the file cannot be written.
    """
    heart = chosen_heart(heart_path)
    target = None if dry_run else chosen_out(heart, out)
    found = default_placement(
        heart_point(heart, inlet),
        heart_point(heart, towards),
        method=f"inlet {before_mm:g} mm before {inlet}, axis towards {towards}; nothing was measured",
        date=date,
        before_mm=before_mm,
    )
    click.echo(
        f"The inlet lies {before_mm:g} mm before {inlet} and the insertion axis runs towards {towards}; nothing was "
        "measured, so positions in the heart mean nothing until it is registered."
    )
    click.echo("Nothing was written (--dry-run)." if target is None else write_registration_file(target, found))


def register_touch(heart_path: Path | None, choice: TouchChoice) -> None:
    """Register by touching landmarks with the tracked tip, guided by a page. Raises as `register_file`."""
    # Imported here: it loads the tracker, which files need not wait for.
    from cathxr.app.register_touch import touch_landmarks

    touch_landmarks(heart_path, choice)
