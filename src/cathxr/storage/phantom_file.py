"""phantom.toml: the holes of a printed phantom and where a seated tip is in each."""

import os
from importlib import resources
from pathlib import Path

from cathxr.core.phantom import Hole, Phantom
from cathxr.storage.toml_table import Table, described, parsed, read_text

SCHEMA = "cathxr-phantom/1"
_LEAST_SPACING_MM = 4.0
_EXAMPLE = 'holes = [{ name = "1", position_mm = [40.0, 0.0, 0.0] }, ...]'


def read_phantom(path: str | os.PathLike[str]) -> Phantom:
    """Return the phantom of a phantom.toml file.

    Raises:
        ConfigError: one sentence with the file, the key, what was expected, and what to do.
    """
    return phantom_from_text(read_text(Path(path), what="a phantom (phantom.toml)"), name=str(path))


def example_phantom_text() -> str:
    """Return the phantom that ships with the package as the text of phantom.toml; it fits the example rig's ROI."""
    return resources.files("cathxr.storage").joinpath("example_phantom.toml").read_text(encoding="utf-8")


def example_phantom() -> Phantom:
    """Return the phantom that ships with the package."""
    return phantom_from_text(example_phantom_text(), name="example_phantom.toml")


def phantom_from_text(text: str, *, name: str = "phantom.toml") -> Phantom:
    """Return the phantom of phantom.toml's text; `name` is the file's name in the sentences.

    Raises:
        ConfigError: see `read_phantom`.
    """
    root = Table(parsed(text, name=name), file=name)
    schema = root.asked("schema", example=f'schema = "{SCHEMA}"')
    if schema != SCHEMA:
        raise root.error("schema", f'expected "{SCHEMA}", got {schema!r}; write schema = "{SCHEMA}".')
    root.know("catheter_diameter_mm")
    title = root.text("name", example='name = "example phantom"', may_be_empty=True)
    diameter = None
    if "catheter_diameter_mm" in root:
        diameter = root.number("catheter_diameter_mm", example="catheter_diameter_mm = 3.0", minimum=0.1, maximum=20.0)
    std = root.number("position_std_mm", example="position_std_mm = 0.05", minimum=0.0, maximum=5.0)
    listed = root.asked("holes", example=_EXAMPLE)
    if not isinstance(listed, list) or not all(isinstance(each, dict) for each in listed):
        raise root.error("holes", f"expected a list of tables, got {described(listed)}; write for example {_EXAMPLE}.")
    holes = tuple(_hole(Table(each, file=name, path=f"holes[{index}]")) for index, each in enumerate(listed))
    root.finish()
    names = [each.name for each in holes]
    twice = next((each for each in names if names.count(each) > 1), None)
    if twice is not None:
        raise root.error("holes", f"expected different names, got {twice!r} twice; name each hole once.")
    if len(holes) < 3:
        raise root.error("holes", f"expected at least 3 holes, got {len(holes)}; add the others.")
    phantom = Phantom(title, holes, std, diameter)
    if phantom.least_spacing_mm < _LEAST_SPACING_MM:
        raise root.error(
            "holes",
            f"expected holes at least {_LEAST_SPACING_MM:.0f} mm apart, got two {phantom.least_spacing_mm:.2f} mm "
            "apart, which a visit could not be told from each other by; correct their positions.",
        )
    return phantom


def _hole(table: Table) -> Hole:
    table.know("region")
    region = table.text("region", example='region = "near"', may_be_empty=True) if "region" in table else ""
    hole = Hole(
        name=table.text("name", example='name = "1"'),
        position_mm=table.vector("position_mm", 3, example="position_mm = [40.0, 0.0, 0.0]"),
        region=region,
    )
    table.finish()
    return hole
