"""What a registration says on the console, and what it writes: registration.toml, and a picture of its errors."""

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from cathxr.core import DataError
from cathxr.registration import Kind, Registration, Solution, registration_toml
from cathxr.registration.drawing import HeartShape, tre_png
from cathxr.storage.atomic import written_whole

PICTURE = "predicted_error.png"


def print_solution(solution: Solution, shape: HeartShape) -> None:
    """Print each landmark's errors, what they mean for the whole heart, and every doubt."""
    found = solution.registration
    console = Console()
    table = Table(title=f"{found.kind.value.capitalize()} registration of {len(found.landmarks)} landmarks, mm")
    for name in ("landmark", "left by the fit", "held out", "predicted there"):
        table.add_column(name, justify="left" if name == "landmark" else "right")
    predicted = solution.predicted_tre_mm(np.stack([each.box_mm for each in found.landmarks]))
    for index, each in enumerate(found.landmarks):
        there = None if predicted is None else float(predicted[index])
        table.add_row(each.name, *(_number(value) for value in (each.residual_mm, each.held_out_mm, there)))
    console.print(table)
    for line in figures(solution, shape):
        console.print(line, highlight=False)
    for doubt in solution.doubts:
        console.print(f"{'Doubt' if doubt.grave else 'Note'}: {doubt.sentence}", highlight=False)


def figures(solution: Solution, shape: HeartShape) -> list[str]:
    """Return the figures in sentences; the FRE never without an error that says more."""
    found = solution.registration
    lines = []
    over = solution.predicted_tre_mm(found.box(shape.vertices_ct))
    if over is None or found.predicted_tre_mm is None:
        lines.append(
            "Predicted error: unknown, for the landmarks leave no degrees of freedom to estimate it; add landmarks, or "
            "state how well they are known (--fle, box_std_mm and ct_std_mm)."
        )
    else:
        lines.append(
            f"Predicted error (TRE): {found.predicted_tre_mm:.2f} mm at the landmarks' centroid, "
            f"{float(np.sqrt(np.mean(np.square(over)))):.2f} mm over the heart (root mean square), {over.max():.2f} mm "
            "at worst."
        )
    if found.tre_mm is None:
        lines.append(f"Held-out error: none, it takes at least {found.kind.fewest_pairs + 1} landmarks; add one.")
    else:
        count = sum(each.held_out_mm is not None for each in found.landmarks)
        lines.append(
            f"Held-out error: {found.tre_mm:.2f} mm (root mean square of {count} landmarks, each left out in turn; it "
            "holds the landmark's own error)."
        )
    known = "" if found.fle_mm is None else f"; each landmark is known to about {found.fle_mm:.2f} mm"
    lines.append(
        f"FRE {found.fre_mm:.2f} mm: how closely the landmarks fit, which is not the error elsewhere{known}. "
        f"{solution.spare} degrees of freedom, condition number {solution.condition:.1f}."
    )
    if found.kind is Kind.SIMILARITY:
        lines.append(f"Scale {found.scale:.4f}.")
    if found.kind is Kind.AFFINE:
        stretch = ", ".join(f"{each:.3f}" for each in solution.stretch)
        lines.append(f"Scale {found.scale:.4f}; along its principal axes the box is stretched by {stretch}.")
    return lines


def write_registration_file(target: Path, registration: Registration) -> str:
    """Write registration.toml whole and return a sentence; an earlier file is kept beside it.

    Raises:
        DataError: it cannot be written; the earlier file is as it was.
    """
    was_there = target.exists()
    with written_whole(target, backup=True) as part:
        part.write_text(registration_toml(registration), encoding="utf-8", newline="\n")
    return f"Written: {target}{' (the earlier file is beside it, .bak)' if was_there else ''}"


def write_picture(folder: Path, solution: Solution, shape: HeartShape) -> str:
    """Write the picture of the errors and return a sentence.

    Raises:
        DataError: it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"The folder {folder} cannot be made ({error.strerror}): give another --report.") from error
    target = folder / PICTURE
    with written_whole(target) as part:
        part.write_bytes(tre_png(solution, shape))
    return f"Picture: {target}"


def _number(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"
