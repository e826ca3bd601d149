"""Writes the quality page of a heart: quality.html, which needs nothing beside it, and its pictures as PNG files."""

from pathlib import Path

from cathxr.heart.jobs import Together, one_after_another
from cathxr.heart.made import Made
from cathxr.heart.quality_checks import checks_of
from cathxr.heart.quality_page import page
from cathxr.heart.quality_slices import slice_pictures
from cathxr.heart.quality_views import view_picture
from cathxr.heart.volume import Progress, silent

PAGE = "quality.html"


def write_quality(
    folder: Path, made: Made, *, together: Together = one_after_another, progress: Progress = silent
) -> None:
    """Write quality.html and quality_*.png into the folder; the same heart gives the same bytes."""
    progress("Checking how the surfaces fit", 0.0)
    checks = checks_of(made)
    progress("Drawing the surfaces", 0.2)
    pictures = {"surfaces": view_picture(made, together=together)}
    progress("Drawing the slices", 0.7)
    pictures |= slice_pictures(made)
    for name, content in pictures.items():
        (folder / f"quality_{name}.png").write_bytes(content)
    (folder / PAGE).write_text(page(made, checks, pictures), encoding="utf-8", newline="\n")
