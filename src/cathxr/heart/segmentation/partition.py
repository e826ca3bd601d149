"""Random walks with priors: which group each voxel of the blood belongs to."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from cathxr.heart.segmentation.distances import distance_to, distance_within, nearest_in
from cathxr.heart.segmentation.flooding import flooded_from
from cathxr.heart.segmentation.walking import graph_of, settled

_STEEPNESS = 30.0
_LEAST_CONDUCTANCE = 3e-4
_PRIOR_WEIGHT, _WEIGHT_FADES_MM = 0.02, 4.0
_VESSEL_SHARE = 0.5
_ROOT_MM, _CHAMBER_MM = 8.0, 3.0
_SEED_WEIGHT = 50.0
_FADING_MM = 2.5
_OTHER_MM = 10.0
_FULL = 0.7
_STEP_COUNTS = 0.5
_OPENING = 40
"""Faces of voxels (about half a square centimetre) that make two lumens one."""


@dataclass(frozen=True, eq=False)
class Pinned:
    """Voxels (N,) as flat indices that belong to the group of this index (the last is: none)."""

    voxels: npt.NDArray[np.int64]
    group: int


def beliefs(distances: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return how likely each group, and last none of them, is (G + 1, N), from the distances (G, N) mm to each."""
    nearest = distances.min(axis=0)
    none = np.maximum(_OTHER_MM - nearest, 0.0)
    powers = -np.concatenate([np.maximum(distances, -_OTHER_MM), none[None]]) / _FADING_MM
    powers -= powers.max(axis=0)
    likely = np.exp(powers)
    return np.asarray(likely / likely.sum(axis=0), np.float32)


def pulls(
    prior: npt.NDArray[np.float32], to_own: npt.NDArray[np.float32], chambers: int
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.bool_]]:
    """Return how strongly the prior (G + 1, N) draws at each node (N,), 0 to 1, and where it is to be believed at all.

    to_own (G, N): distance mm to the atlas's chamber that each group is, or springs from; the first `chambers` groups
    are chambers. Vessels run differently in every chest: they are believed at their roots only and weakly; further on,
    what a voxel hangs together with says more than where it lies.
    """
    likeliest = prior.argmax(axis=0)
    distance = np.concatenate([to_own, np.full((1, to_own.shape[1]), np.inf, np.float32)])
    own = np.take_along_axis(distance, likeliest[None], axis=0)[0].astype(float)
    vessel = likeliest >= chambers
    pull = np.exp(-np.maximum(own - _FADING_MM, 0.0) / _WEIGHT_FADES_MM) * np.where(vessel, _VESSEL_SHARE, 1.0)
    return np.asarray(pull), np.asarray(own < np.where(vessel, _ROOT_MM, _CHAMBER_MM))


def walks(
    share: npt.NDArray[np.float32],
    nodes: npt.NDArray[np.bool_],
    prior: npt.NDArray[np.float32],
    pull: npt.NDArray[np.float64],
    pinned: Sequence[Pinned] = (),
) -> npt.NDArray[np.float32]:
    """Return the probability of each group (G + 1, N) at the N nodes.

    share (K, J, I): 0 tissue, 1 blood; what lies between two voxels that is darker than blood keeps walkers apart, so
    that borders follow walls and, where there are none, the narrowest place near where `prior` (G + 1, N) has them.
    pull (N,): how strongly the prior draws at each node, 0 to 1.
    L. Grady, "Multilabel random walker image segmentation using prior models", CVPR 2005.
    """
    neighbours, conductances = graph_of(share, nodes, steepness=_STEEPNESS, least=_LEAST_CONDUCTANCE)
    pull = _PRIOR_WEIGHT * pull
    wanted = prior.copy()
    for pin in pinned:
        at = np.flatnonzero(np.isin(np.flatnonzero(nodes), pin.voxels))
        pull[at] = _SEED_WEIGHT
        wanted[:, at] = 0.0
        wanted[pin.group, at] = 1.0
    solved = np.empty_like(prior)
    for index, each in enumerate(wanted[:-1]):
        solved[index] = np.clip(settled(neighbours, conductances, pull, each), 0.0, 1.0)
    solved[-1] = np.clip(1.0 - solved[:-1].sum(axis=0), 0.0, 1.0)
    return solved


def largest_pieces(
    share: npt.NDArray[np.float32], nodes: npt.NDArray[np.bool_], found: npt.NDArray[np.float32]
) -> npt.NDArray[np.bool_]:
    """Return which nodes (K, J, I) are of their group's largest piece of full blood."""
    owner = np.full(nodes.shape, -1, np.int16)
    owner[nodes] = found.argmax(axis=0)
    owner[share < _FULL] = -1
    kept = np.zeros_like(nodes)
    for group in range(len(found) - 1):
        pieces, count = ndimage.label(owner == group)
        if count:
            kept |= pieces == 1 + int(np.bincount(pieces.ravel())[1:].argmax())
    return kept


def rival(
    share: npt.NDArray[np.float32],
    nodes: npt.NDArray[np.bool_],
    found: npt.NDArray[np.float32],
    springs: Mapping[int, int],
) -> int | None:
    """Return the great artery's group that shares another's lumen and opens less to its own ventricle, if one does.

    springs: vessel's group to that of the ventricle it springs from.
    """
    owner = np.full(nodes.shape, -1, np.int16)
    owner[nodes] = found.argmax(axis=0)
    owner[share < _FULL] = -1
    first, second = springs
    if _faces(owner, first, second) < _OPENING:
        return None
    return min(springs, key=lambda vessel: _faces(owner, vessel, springs[vessel]))


def _faces(owner: npt.NDArray[np.int16], one: int, other: int) -> int:
    """Return how many voxels' faces are between two groups."""
    total = 0
    for axis in range(3):
        low = owner[tuple(slice(None, -1) if each == axis else slice(None) for each in range(3))]
        high = owner[tuple(slice(1, None) if each == axis else slice(None) for each in range(3))]
        total += int((((low == one) & (high == other)) | ((low == other) & (high == one))).sum())
    return total


def flooded(
    share: npt.NDArray[np.float32],
    nodes: npt.NDArray[np.bool_],
    found: npt.NDArray[np.float32],
    outside: npt.NDArray[np.bool_],
    further: npt.NDArray[np.bool_],
    radius: float,
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.float32]]:
    """Return the nodes (K, J, I) with the further ones that hang together with them, and all their probabilities.

    found (G + 1, N): of the nodes. outside (K, J, I): certainly of no group. Each further voxel that is part of
    something thicker than `radius` voxels takes the group of the node from which it is reached through the brightest
    blood: vessels are followed, walls are not crossed while there is another way.
    """
    markers = np.zeros(nodes.shape, np.uint8)
    markers[outside] = len(found)
    markers[nodes] = found.argmax(axis=0) + 1
    thick = distance_within(further | nodes, 1.0) >= radius
    wide = distance_to(thick, 1.0) < radius
    open_to_it = nodes | outside | (further & wide)
    # A step in brightness parts two lumens too, as of a cava full of contrast on the pulmonary artery behind it.
    steps = ndimage.gaussian_gradient_magnitude(share, 0.7)
    landscape = np.round((np.clip(1.0 - share, 0.0, 1.0) + _STEP_COUNTS * steps) * 100.0).astype(np.uint16)
    reached = flooded_from(landscape, markers, open_to_it)
    both = reached > 0
    out = (np.arange(1, len(found) + 1)[:, None] == reached[both]).astype(np.float32)
    out[:, nodes[both]] = found
    return both, out


def spread(values: npt.NDArray[np.float32], nodes: npt.NDArray[np.bool_], steps: int = 2) -> npt.NDArray[np.float32]:
    """Return the nodes' values (G + 1, N) on the whole grid (G + 1, K, J, I).

    Each other voxel takes its nearest node's; beyond `steps` voxels from all nodes the last group, none, is certain.
    """
    away, index = nearest_in(nodes, 1.0)
    number = np.zeros(nodes.size, np.int32)
    number[nodes.ravel()] = np.arange(values.shape[1], dtype=np.int32)
    near = away <= steps
    out = np.zeros((len(values), *nodes.shape), np.float32)
    out[:, near] = values[:, number[index[near]]]
    out[-1, ~near] = 1.0
    return out
