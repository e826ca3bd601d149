"""What the values of a label map mean: a names file, the file's own table, or a known numbering."""

import csv
import io
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

from cathxr.core import ConfigError, DataError
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.reading.structure_names import key_of

MM_WHS: Mapping[int, str] = MappingProxyType(
    {
        205: "myocardium",
        420: "left_atrium",
        500: "left_ventricle",
        550: "right_atrium",
        600: "right_ventricle",
        820: "aorta",
        850: "pulmonary_artery",
    }
)
"""The numbering of the whole-heart segmentation challenge, which no other one uses."""

_NOTHING = ("", "none", "background", "ignore", "other")


def read_names(path: Path) -> dict[int, str | None]:
    """Return the structure's key by label, None for a label that is to be left out.

    TOML: `1 = "left_ventricle"` or `left_ventricle = 1`, at the top or under `[labels]`. CSV: a number and a name in
    each row, in either order; a first row of titles is passed over.

    Raises:
        ConfigError: the file cannot be read, or a name in it is no structure's.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError):
        raise ConfigError(f"{path} cannot be read as text; give a TOML or CSV file of labels and names.") from None
    pairs = _from_csv(text) if path.suffix.lower() in (".csv", ".txt", ".tsv") else _from_toml(text, path)
    names: dict[int, str | None] = {}
    for label, name in pairs:
        key = key_of(name)
        if key is None and name.strip().lower() not in _NOTHING:
            raise ConfigError(f"{path}: the name of label {label} is no structure's; known are {', '.join(CATALOGUE)}.")
        names[label] = key
    if not names:
        raise ConfigError(f'{path} names no label; write lines as `1 = "left_ventricle"` (TOML) or 1,left_ventricle.')
    return names


def names_for(path: Path, values: Iterable[int], *, own: Mapping[int, str], stem: str) -> dict[int, str | None]:
    """Return the keys of a label map's values (without 0) where no names file is given.

    own: names that the file itself holds. stem: the file's name, which says what a map of one value is.

    Raises:
        DataError: nothing says what the values mean.
    """
    wanted = sorted(values)
    if own:
        named = {label: key_of(name) for label, name in own.items()}
        if any(named.get(each) for each in wanted):
            return {each: named.get(each) for each in wanted}
    if len(wanted) == 1 and (key := key_of(stem)):
        return {wanted[0]: key}
    if set(wanted) <= set(MM_WHS) and len(wanted) > 1:
        return {each: MM_WHS[each] for each in wanted}
    catalogue = {each.label: each.key for each in CATALOGUE.values()}
    if len(wanted) > 1 and set(wanted) <= set(catalogue):
        return {each: catalogue[each] for each in wanted}
    listed = ", ".join(map(str, wanted[:12])) + (", …" if len(wanted) > 12 else "")
    raise DataError(
        f"{path} holds the labels {listed}, and nothing says which structures they are; give a file of names with "
        "--names (docs/heart-data.md shows one)."
    )


def _from_csv(text: str) -> list[tuple[int, str]]:
    delimiter = max(",;\t", key=text.count)
    pairs = []
    for row in csv.reader(io.StringIO(text), delimiter=delimiter):
        cells = [each.strip() for each in row if each.strip()]
        numbers, words = [each for each in cells if each.isdigit()], [each for each in cells if not each.isdigit()]
        if numbers and words:
            pairs.append((int(numbers[0]), words[0]))
    return pairs


def _from_toml(text: str, path: Path) -> list[tuple[int, str]]:
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        raise ConfigError(f'{path} is not valid TOML; a line of it looks like `1 = "left_ventricle"`.') from None
    table = document.get("labels", document)
    pairs: list[tuple[int, str]] = []
    for left, right in table.items() if isinstance(table, dict) else ():
        if isinstance(right, int) and not isinstance(right, bool):
            pairs.append((right, left))
        elif isinstance(right, str) and left.isdigit():
            pairs.append((int(left), right))
    return pairs
