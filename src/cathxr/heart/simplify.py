"""Fewer triangles for the same shape, by quadric errors. Needs the extra `heart`."""

import importlib

import numpy as np

from cathxr.core import ConfigError
from cathxr.heart.surface import Surface

_AGGRESSIVENESS = 5.0
"""fast-simplification's scale from 0 (slow, faithful) to 10."""


def simplified(surface: Surface, triangles: int) -> Surface:
    """Return the surface with about `triangles` triangles, or as it is where it has no more than that.

    Garland and Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997.

    Raises:
        ConfigError: the package fast-simplification is not installed.
    """
    try:
        fast_simplification = importlib.import_module("fast_simplification")
    except ImportError as error:
        raise ConfigError(
            "Simplifying a surface needs the package fast-simplification; run pip install 'cathxr[heart]'."
        ) from error
    if len(surface.triangles) <= triangles:
        return surface
    vertices, faces = fast_simplification.simplify(
        surface.vertices_mm.astype(np.float32),
        surface.triangles.astype(np.int32),
        target_count=triangles,
        agg=_AGGRESSIVENESS,
    )
    kept = Surface(np.asarray(vertices, dtype=np.float64), np.asarray(faces, dtype=np.int64))
    return kept.keep(np.linalg.norm(kept.area_vectors, axis=1) > 0.0)
