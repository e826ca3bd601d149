"""Rebuilds the built-in heart, by the pipeline of `cathxr heart build`, from the STL surfaces of `heart_rodero01`.

    python scripts/build_heart.py --source ../shared/data/heart_rodero01/derived_stl

Needs the extra `heart`. The same surfaces and library versions give the same bytes.
"""

import os
import shutil
import tempfile
from pathlib import Path

import click

from cathxr.core import CathxrError
from cathxr.heart import HeartFolder, builtin_path
from cathxr.heart.acoustic import acoustic_volume
from cathxr.heart.build import build_heart
from cathxr.heart.builtin_recipe import ACOUSTIC_SIZE, BUDGET, NAME, SOURCE, Ingredients, ingredients
from cathxr.registration import BEFORE_MM, default_placement, registration_toml

PLACEMENT_DATE = "2026-11-22"
PLACEMENT_METHOD = (
    f"default placement, nothing measured: the inlet {BEFORE_MM:g} mm before the inferior vena cava's mouth, +x "
    "towards the centre of the superior vena cava's, +z as near to anterior as that allows"
)
SHIPPED = ("heart.glb", "heart.toml", "labels.nii.gz", "acoustic.bin.gz", "registration.toml")
"""What of the heart folder comes with the package: not the quality page, which anybody can make."""


def build(source: Path, out: Path) -> HeartFolder:
    """Write the heart folder at `out` and return it."""
    made = ingredients(source, progress=_tell)
    acoustic = acoustic_volume(made.walled, openings=made.places.openings, size=ACOUSTIC_SIZE, progress=_tell)
    return build_heart(
        out,
        volume=None,
        labels=made.labels,
        findings=made.places.findings,
        source=SOURCE,
        name=NAME,
        budget=BUDGET,
        places=made.places,
        acoustic=acoustic,
        registration=_placement(made),
        progress=_tell,
    )


def _placement(made: Ingredients) -> str:
    """Return the text of registration.toml: the inlet before the inferior vena cava."""
    openings = made.places.openings
    return registration_toml(
        default_placement(
            openings["inferior_vena_cava"].centroid_mm,
            openings["superior_vena_cava"].centroid_mm,
            method=PLACEMENT_METHOD,
            date=PLACEMENT_DATE,
        )
    )


def _tell(what: str, share: float | None) -> None:
    """Show what is being done."""
    click.echo(what if share is None else f"{what} ({share:.0%})", err=True)


def _ship(built: Path, out: Path) -> None:
    """Put the shipped files at `out`, each in one step; what else is there, the attribution, stays."""
    out.mkdir(parents=True, exist_ok=True)
    for name in SHIPPED:
        beside = out / f"{name}.part"
        shutil.copyfile(built / name, beside)
        os.replace(beside, out / name)


@click.command()
@click.option("--source", type=click.Path(path_type=Path), required=True, help="Folder of the STL files and caps.json.")
@click.option("--out", type=click.Path(path_type=Path), default=builtin_path(), help="Heart folder to write.")
@click.option("--whole", is_flag=True, help="Write the whole heart folder, with its quality page.")
def main(source: Path, out: Path, whole: bool) -> None:
    """Rebuild the built-in heart from its STL surfaces."""
    try:
        if whole:
            build(source, out)
        else:
            with tempfile.TemporaryDirectory() as folder:
                built = Path(folder) / "heart"
                build(source, built)
                _ship(built, out)
    except CathxrError as error:
        raise click.ClickException(str(error)) from error
    for path in sorted(out.iterdir()):
        click.echo(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
