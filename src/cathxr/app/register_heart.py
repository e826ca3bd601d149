"""What registering needs of a heart folder: its named points, its surface, and where its registration goes."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cathxr.core import ConfigError, FloatArray
from cathxr.heart import HeartFolder, builtin_path, read_heart
from cathxr.heart.glb import read_glb, surface
from cathxr.storage.atomic import check_writable

if TYPE_CHECKING:
    from cathxr.registration.drawing import HeartShape

FILE_NAME = "registration.toml"


def chosen_heart(path: Path | None) -> HeartFolder:
    """Return the heart folder that was given; None: the built-in heart.

    Raises:
        CathxrError: it cannot be read.
    """
    return read_heart(builtin_path() if path is None else path)


def heart_shape(heart: HeartFolder) -> "HeartShape":
    """Return the whole heart's surface, each part in its colour.

    Raises:
        DataError: the GLB file is damaged.
    """
    from cathxr.registration.drawing import HeartShape  # with matplotlib, which only pictures need

    document, binary = read_glb(heart.glb)
    vertices: list[FloatArray] = []
    triangles, colours, count = [], [], 0
    for part in heart.structures.values():
        points, corners = surface(document, binary, part.node)
        vertices.append(points)
        triangles.append(corners + count)
        colours += [part.colour] * len(corners)
        count += len(points)
    return HeartShape(np.concatenate(vertices), np.concatenate(triangles), colours)


def chosen_out(heart: HeartFolder, out: Path | None) -> Path:
    """Return where the registration is written: --out, or registration.toml in the heart's folder.

    Raises:
        ConfigError: it would go into the built-in heart; DataError: no file can be made there.
    """
    if out is None and heart.path.resolve() == builtin_path().resolve():
        raise ConfigError(
            "The built-in heart keeps its own placement: give --out registration.toml, or copy the heart's folder "
            f"{heart.path} and give the copy with --heart."
        )
    target = heart.path / FILE_NAME if out is None else out
    check_writable(target, what="the registration")
    return target


def far_outside(shape: "HeartShape", name: str, point_ct: FloatArray) -> str:
    """Return a sentence where a point (3,) lies so far off the heart that its coordinates are another's; else ""."""
    low, high = shape.vertices_ct.min(axis=0), shape.vertices_ct.max(axis=0)
    off = float(np.linalg.norm(np.maximum(np.maximum(low - point_ct, point_ct - high), 0.0)))
    if off < 0.5 * float(np.linalg.norm(high - low)):
        return ""
    return (
        f"{name} lies {off:.0f} mm outside the heart in `ct`: check that its coordinates are of this heart, in LPS "
        "(RAS has the other sign of x and y)."
    )
