"""Writes which device is which camera, and its locked settings, into config.toml; all else in the file stays."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from cathxr.app.config import read_config
from cathxr.core import ConfigError
from cathxr.devices.camera_lock import PROPERTIES, LockedSettings
from cathxr.devices.listing import stable_name
from cathxr.storage.atomic import written_whole
from cathxr.storage.toml_edit import with_table
from cathxr.storage.toml_table import read_text

_NEW = 'schema = "cathxr-config/1"\n'
_LOCKED = tuple(name for name, _ in PROPERTIES)


def write_camera_choice(path: Path, choices: Mapping[str, tuple[int | str, LockedSettings]]) -> str:
    """Write each role's device and settings into the configuration at `path`; return a sentence that says so.

    choices: by "top" and "front". An earlier file stays beside it; a missing one is made. Options such as fourcc stay.

    Raises:
        ConfigError: the file is not a configuration; DataError: it cannot be written.
    """
    exists = path.exists()
    if exists:
        read_config(path)
    before = read_text(path, what="the configuration (config.toml)") if exists else _NEW
    document = tomllib.loads(before)
    text, comments_kept = before, True
    for role, (device, locked) in choices.items():
        earlier = document.get("cameras", {}).get(role, {})
        options = {key: value for key, value in earlier.items() if key not in _LOCKED and key != "device"}
        # Where the camera named its controls after all, they stay as whole numbers: people read this file.
        settings = {name: _short(value) for name, value in locked.options.items()}
        values = {"device": stable_name(device), **options, **settings}
        try:
            text = with_table(text, ("cameras", role), values)
        except ConfigError:
            text, comments_kept = _without_comments(text, role, values), False
    with written_whole(path, backup=exists) as part:
        part.write_text(text, encoding="utf-8", newline="\n")
    sentence = f"The cameras and their settings are in {path}"
    if exists:
        sentence += " (the earlier file is beside it)"
    if not comments_kept:
        sentence += "; the file's comments could not be kept, because it writes [cameras] in another way"
    return f"{sentence}."


def _without_comments(text: str, role: str, values: Mapping[str, Any]) -> str:
    document = tomllib.loads(text)
    document.setdefault("cameras", {})[role] = dict(values)
    return tomli_w.dumps(document)


def _short(value: float) -> float | int:
    return int(value) if value == int(value) else round(value, 4)
