"""Surfaces from labels. Needs the extra `heart`."""

from cathxr.heart.surfaces.parts import PartSurface, SurfaceChecks, surfaces_of

__all__ = ["PartSurface", "SurfaceChecks", "surfaces_of"]
