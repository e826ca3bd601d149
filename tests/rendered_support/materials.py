"""The catheter's and the box's materials, as Mitsuba's dictionaries, and the pieces that a catheter is made of."""

from pathlib import Path
from typing import Any

import numpy as np

from cathxr.core import FloatArray

from .worlds import World

Part = dict[str, Any]

_ROUGH = {
    "blue": ((0.02, 0.04, 0.15), 0.15),
    "white": ((0.8, 0.8, 0.78), 0.2),
    "red": ((0.6, 0.05, 0.05), 0.2),
    "yellow": ((0.7, 0.6, 0.1), 0.2),
    "grey": ((0.3, 0.3, 0.3), 0.2),
}
_BANDS, _BAND_MM = ("white", "red", "yellow", "blue"), 8.0
_RINGS_MM, _RING_MM = (3.0, 7.0, 11.0, 15.0), 1.5


def colour(*value: float) -> Part:
    """Return a colour: one value for grey, or red, green and blue."""
    return {"type": "rgb", "value": list(value) if len(value) > 1 else value[0]}


def material(name: str) -> Part:
    """Return the surface of a material by its name."""
    if name == "black":
        return {"type": "plastic", "diffuse_reflectance": colour(0.02, 0.02, 0.02)}
    if name == "metal":
        return {"type": "roughconductor", "material": "Al", "alpha": 0.2}
    diffuse, roughness = _ROUGH[name]
    return {"type": "roughplastic", "diffuse_reflectance": colour(*diffuse), "alpha": roughness}


def catheter(world: World, points: FloatArray, folder: Path, transform: Any) -> dict[str, Part]:
    """Return the parts of a catheter along points (N, 3), mm, the last in the middle of its end.

    folder: where the curves' files go, which Mitsuba reads. transform: Mitsuba's class of transformations.
    """
    radius = 0.5 * world.diameter_mm
    lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
    from_tip = np.append(np.cumsum(lengths[::-1])[::-1], 0.0)
    parts: dict[str, Part] = {}

    def piece(name: str, kind: str, begin_mm: float, end_mm: float, thicker_mm: float = 0.0) -> None:
        here = np.flatnonzero((from_tip >= begin_mm - 0.3) & (from_tip <= end_mm + 0.3))
        if len(here) >= 4:
            parts[name] = _tube(points[here], radius + thicker_mm, material(kind), folder / f"{name}.txt")

    end = world.material
    if world.material == "bands":
        for index in range(int(from_tip[0] // _BAND_MM) + 1):
            piece(f"band{index}", _BANDS[index % len(_BANDS)], index * _BAND_MM, (index + 1) * _BAND_MM)
        end = _BANDS[0]
    elif world.material == "rings":
        piece("tube", "blue", 0.0, np.inf)
        for index, at in enumerate(_RINGS_MM):
            piece(f"ring{index}", "metal", at, at + _RING_MM, 0.02)
        end = "metal"
    else:
        piece("tube", world.material, 0.0, np.inf)
    parts["end"] = _end(world, points, material(end), transform)
    return parts


def _tube(points: FloatArray, radius: float, surface: Part, path: Path) -> Part:
    """Return a tube that goes on to the first and the last point: a B-spline ends one control point before them."""
    whole = np.vstack([2.0 * points[0] - points[1], points, 2.0 * points[-1] - points[-2]])
    np.savetxt(path, np.column_stack([whole, np.full(len(whole), radius)]), fmt="%.6f")
    return {"type": "bsplinecurve", "filename": str(path), "bsdf": {"type": "twosided", "surface": surface}}


def _end(world: World, points: FloatArray, surface: Part, transform: Any) -> Part:
    radius = 0.5 * world.diameter_mm
    if world.end == "round":
        return {"type": "sphere", "center": points[-1].tolist(), "radius": radius, "bsdf": surface}
    ahead = (2.0 * points[-1] - points[-2]).tolist()
    pose = transform().look_at(origin=points[-1].tolist(), target=ahead, up=[0.1, 0.2, 0.9]).scale(radius)
    return {"type": "disk", "to_world": pose, "bsdf": {"type": "twosided", "surface": surface}}
