"""Smooth fields of labels: where each structure ends, finer than a voxel, with its volume kept and no gap between two.

Every structure's mask is blurred a little; a point belongs to the structure whose blurred mask plus that structure's
bias is the largest there, the surroundings (bias zero) included. Two neighbours so share one boundary, and the biases
are chosen so that every structure keeps its volume: the volume-keeping form of the scheme of Merriman, Bence and Osher
(Ruuth and Wetton, "A simple scheme for volume-preserving motion by mean curvature", J. Scientific Computing 2003).
"""

from dataclasses import dataclass
from functools import partial

import cv2
import numpy as np
import numpy.typing as npt
from numba import njit
from scipy import ndimage

from cathxr.core import FloatArray
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.jobs import Together, one_after_another
from cathxr.heart.volume import Grid, LabelVolume

Field = npt.NDArray[np.float32]
_SMOOTHING_VOXELS = 1.0
"""The blur's standard deviation in voxels of the mean spacing: what it takes for stair-steps to vanish."""
_SMOOTHING_LIMITS_MM = (0.5, 1.2)
_REACH = 3.0
_CERTAIN = 0.995
"""A voxel whose largest blurred mask is above this belongs to it whatever the biases are."""
_BALANCED_VOXELS, _MOST_STEP, _BAND_VOXELS = 10_000_000, 4, 1_000_000
"""So many voxels, and of them so many uncertain ones, are enough to find the biases; `at_volume` sees to the rest."""
_BIAS_ROUNDS = 12
_BIAS_LIMIT = 0.45
_JOINED_SIGMA, _JOINED_GAIN = 1.5, np.float32(4.0)
"""With these a face of voxels that touch gives 1 up to its rim, and less than 0.2 two voxels beyond."""
_GRADIENT = np.sqrt(2.0 * np.pi) / 2.0
"""Distance to a plane boundary in standard deviations, for each unit of difference of two blurred masks next to it."""


@dataclass(frozen=True, eq=False)
class Box:
    """A box of voxels: its first (k, j, i), and whether each side (3, 2) lies on the volume's end."""

    first: tuple[int, int, int]
    shape: tuple[int, int, int]
    at_end: npt.NDArray[np.bool_]

    @property
    def slices(self) -> tuple[slice, ...]:
        """The box as an index into the whole volume."""
        return tuple(slice(a, a + n) for a, n in zip(self.first, self.shape, strict=True))

    def within(self, outer: "Box") -> tuple[slice, ...]:
        """Return the box as an index into an array of `outer`, which holds it."""
        return tuple(slice(a - b, a - b + n) for a, b, n in zip(self.first, outer.first, self.shape, strict=True))


@dataclass(frozen=True, eq=False)
class LevelSet:
    """One structure. inside: float32 over `box`, above zero inside.

    cap: float32 over `box`: above zero where the nearest neighbour is other blood rather than a wall.
    """

    key: str
    box: Box
    inside: Field
    cap: Field
    volume_ml: float


class Fields:
    """The blurred masks of every structure of a label volume, with the biases that keep their volumes.

    keys: the structures that are there. Raises ValueError where there is none.
    """

    def __init__(self, labels: LabelVolume, keys: tuple[str, ...], *, together: Together = one_after_another) -> None:
        self.grid = labels.grid
        self.keys = keys
        self.voxel_mm = float(labels.grid.spacing_mm.prod() ** (1 / 3))
        self.sigma_voxels = _sigma_voxels(labels.grid)
        values = {key: [value for value, name in labels.names.items() if name == key] for key in keys}
        lookup = np.zeros(256, np.uint8)
        for number, key in enumerate(keys):
            lookup[values[key]] = number + 1
        margin = np.ceil(self.sigma_voxels * _REACH).astype(int) + 2
        whole = _bounding_box(labels.labels, margin)
        self.whole = whole
        self.numbers = numbers = lookup[labels.labels[whole.slices]]
        inner = ndimage.find_objects(numbers, max_label=len(keys))
        self.boxes: list[Box] = []
        self.voxels = np.array([labels.voxels(key) for key in keys], float)
        self.touching = {(one - 1, other - 1): cells for (one, other), cells in touching(numbers).items()}
        self.outside = np.ones(whole.shape, np.float32)
        for found in inner:
            assert found is not None
            self.boxes.append(_grown(found, whole, margin, labels.grid.shape))
        self.masks: list[Field] = together([partial(self._blurred_mask, number) for number in range(len(keys))])
        for box, mask in zip(self.boxes, self.masks, strict=True):
            self.outside[box.within(whole)] -= mask
        self.biases = self._balanced()

    def _blurred_mask(self, number: int) -> Field:
        mask = self.numbers[self.boxes[number].within(self.whole)] == number + 1
        return _blurred(mask.astype(np.float32), self.sigma_voxels)

    def level_set(self, key: str) -> LevelSet:
        """Return one structure's level set."""
        number = self.keys.index(key)
        box, mask = self.boxes[number], self.masks[number]
        own = mask + np.float32(self.biases[number])
        supported = own.copy()
        walls = self.outside[box.within(self.whole)].copy()
        blood = np.full(box.shape, -1.0, np.float32)
        beyond = np.full(box.shape, -1.0, np.float32)
        for other, (other_box, other_mask) in enumerate(zip(self.boxes, self.masks, strict=True)):
            overlap = _overlap(box, other_box)
            if other == number or overlap is None:
                continue
            here = overlap.within(box)
            theirs = other_mask[overlap.within(other_box)] + np.float32(self.biases[other])
            if not (CATALOGUE[key].blood and CATALOGUE[self.keys[other]].blood):
                np.maximum(walls[here], theirs, out=walls[here])
                continue
            np.maximum(blood[here], theirs, out=blood[here])
            np.maximum(beyond[here], theirs, out=beyond[here])
            found = self._joined(number, other, overlap)
            if found is not None:
                near, joined = found
                theirs = other_mask[near.within(other_box)] + np.float32(self.biases[other])
                supported[near.within(box)] += joined * theirs
                at = near.within(box)
                np.maximum(beyond[at], theirs + joined * own[at], out=beyond[at])
        inside = np.minimum(supported - walls, own - blood)
        # Blurred once more, so that a rim does not follow single voxels.
        cap = _blurred(beyond - walls, self.sigma_voxels)
        return LevelSet(key, box, inside, cap, float(self.voxels[number]) * self.grid.voxel_ml)

    def _joined(self, one: int, other: int, within: Box) -> tuple[Box, Field] | None:
        """Return how near (0 to 1) the face is in which the voxels of two structures touch, and over which box.

        There the two are one pool of blood to the wall beside them. Else each would draw back from the rim that they
        share with it, and leave a groove around every valve. None where they touch nowhere.
        """
        cells = self.touching.get((min(one, other), max(one, other)))
        if cells is None:
            return None
        sigma = _JOINED_SIGMA * self.sigma_voxels
        cells = cells + np.array(self.whole.first)
        reach = np.ceil(_REACH * sigma).astype(int) + 1
        found = _box(list(cells.min(axis=0)), list(cells.max(axis=0) + 1), reach, self.grid.shape)
        box = _overlap(found, within)
        if box is None:
            return None
        face = np.zeros(box.shape, np.float32)
        face[tuple((cells - np.array(box.first)).T)] = 1.0
        return box, np.asarray(np.minimum(_JOINED_GAIN * _blurred(face, sigma), np.float32(1.0)))

    def _balanced(self) -> FloatArray:
        """Return the bias of each structure with which it keeps its volume."""
        # Of very many slices some tell the volumes as well as all do, and so do voxels evenly chosen of them.
        step = int(np.clip(self.numbers.size // _BALANCED_VOXELS, 1, _MOST_STEP))
        outside = self.outside[::step]
        largest = outside.copy()
        seen: list[tuple[int, npt.NDArray[np.float32]]] = []
        for box, mask in zip(self.boxes, self.masks, strict=True):
            start = box.first[0] - self.whole.first[0]
            some = mask[-start % step :: step]
            first = -(-start // step)
            seen.append((first, some))
            here = largest[(slice(first, first + len(some)), *box.within(self.whole)[1:])]
            np.maximum(here, some, out=here)
        band = np.flatnonzero(largest < _CERTAIN)
        del largest
        scale = max(len(band) / _BAND_VOXELS, 1.0)
        band = band[np.linspace(0, len(band) - 1, int(len(band) / scale)).astype(np.int64)]
        table = np.zeros((len(band), len(self.keys) + 1), np.float32)
        table[:, 0] = outside.reshape(-1)[band]
        at = np.stack(np.unravel_index(band, outside.shape))
        certain = np.zeros(len(self.keys))
        wanted = np.bincount(self.numbers[::step].ravel(), minlength=len(self.keys) + 1)[1:]
        for number, (box, (first, some)) in enumerate(zip(self.boxes, seen, strict=True)):
            local = at - np.array([first, *(np.array(box.first) - self.whole.first)[1:]])[:, None]
            held = np.all((local >= 0) & (local < np.array(some.shape)[:, None]), axis=0)
            table[held, number + 1] = some[tuple(local[:, held])]
            certain[number] = np.count_nonzero(some >= _CERTAIN)
        slope = float(self.sigma_voxels.prod() ** (1 / 3)) * _GRADIENT
        biases = np.zeros(len(self.keys))
        for _ in range(_BIAS_ROUNDS):
            volumes, gains = _volumes(table, biases, slope)
            change = (wanted - certain - scale * volumes) / np.maximum(scale * gains, 1.0)
            biases = np.clip(biases + 0.8 * np.clip(change, -0.1, 0.1), -_BIAS_LIMIT, _BIAS_LIMIT)
        return np.asarray(biases)


@njit(cache=True, nogil=True)
def _volumes(
    table: npt.NDArray[np.float32], biases: FloatArray, slope: float
) -> tuple[FloatArray, FloatArray]:  # pragma: no cover - compiled
    """Return each structure's share of the table's voxels, in voxels, and how much more a unit of bias gives it."""
    count = table.shape[1]
    volumes = np.zeros(count - 1)
    gains = np.zeros(count - 1)
    for row in range(table.shape[0]):
        first, second, best = -9.0, -9.0, 0
        for column in range(count):
            value = table[row, column] + (biases[column - 1] if column else 0.0)
            if value > first:
                second, first, best = first, value, column
            elif value > second:
                second = value
        # Only the two largest can own a part of the voxel.
        for column in range(1, count):
            value = table[row, column] + biases[column - 1]
            if value < second:
                continue
            other = second if column == best else first
            share = 0.5 + (value - other) * slope
            if share >= 1.0:
                volumes[column - 1] += 1.0
            elif share > 0.0:
                volumes[column - 1] += share
                gains[column - 1] += slope
    return volumes, gains


def _sigma_voxels(grid: Grid) -> FloatArray:
    """Return the blur's standard deviation along k, j and i, in voxels: one length in mm in all directions."""
    spacing = grid.spacing_mm[::-1]
    mean = float(spacing.prod() ** (1 / 3))
    sigma_mm = np.clip(_SMOOTHING_VOXELS * mean, *_SMOOTHING_LIMITS_MM)
    # Thick slices need at least some blur across them, thin ones must not be blurred away.
    return np.asarray(np.maximum(sigma_mm / spacing, 0.6))


def _blurred(mask: Field, sigma_voxels: FloatArray) -> Field:
    """Return the mask blurred by a Gaussian; what lies at the end of the array goes on beyond it."""
    kernels = [cv2.getGaussianKernel(2 * int(np.ceil(s * _REACH)) + 1, s, cv2.CV_32F) for s in sigma_voxels]
    one = np.ones(1, np.float32)
    k, j, i = mask.shape
    along_k = cv2.sepFilter2D(mask.reshape(k, j * i), -1, one, kernels[0], borderType=cv2.BORDER_REPLICATE)
    out = np.empty_like(mask)
    for number, piece in enumerate(along_k.reshape(k, j, i)):
        out[number] = cv2.sepFilter2D(piece, -1, kernels[2], kernels[1], borderType=cv2.BORDER_REPLICATE)
    return out


def touching(labels: npt.NDArray[np.uint8]) -> dict[tuple[int, int], npt.NDArray[np.int64]]:
    """Return the voxels (N, 3) k, j, i on both sides of the faces in which two labels touch, by the two, smaller first.

    What is labelled 0 touches nothing.
    """
    pairs, cells = [], []
    for axis in range(3):
        low: list[slice] = [slice(None)] * 3
        high: list[slice] = [slice(None)] * 3
        low[axis], high[axis] = slice(None, -1), slice(1, None)
        one, other = labels[tuple(low)], labels[tuple(high)]
        apart = one != other
        apart &= one != 0
        apart &= other != 0
        at = np.stack(np.unravel_index(np.flatnonzero(apart), apart.shape), axis=1)
        both = np.sort(np.stack([one[apart], other[apart]], axis=1).astype(np.int64), axis=1)
        beside = at.copy()
        beside[:, axis] += 1
        pairs += [both, both]
        cells += [at, beside]
    code = np.concatenate(pairs) @ np.array([256, 1])
    places = np.concatenate(cells)
    return {(int(each) // 256, int(each) % 256): places[code == each] for each in np.unique(code)}


def _bounding_box(labels: npt.NDArray[np.uint8], margin: npt.NDArray[np.int64]) -> Box:
    """Return the box of what is labelled, with a margin as far as the volume reaches."""
    rows, slices = labels.max(axis=2), labels.max(axis=1)
    ranges = [np.flatnonzero(each) for each in (rows.max(axis=1), rows.max(axis=0), slices.max(axis=0))]
    if not all(each.size for each in ranges):
        raise ValueError("labels: expected at least one voxel with a label")
    return _box([each[0] for each in ranges], [each[-1] + 1 for each in ranges], margin, labels.shape)


def _grown(found: tuple[slice, ...], whole: Box, margin: npt.NDArray[np.int64], shape: tuple[int, int, int]) -> Box:
    """Return the box of `found` (within `whole`) with a margin as far as the volume reaches."""
    first = [s.start + a for s, a in zip(found, whole.first, strict=True)]
    last = [s.stop + a for s, a in zip(found, whole.first, strict=True)]
    return _box(first, last, margin, shape)


def _box(first: list[int], last: list[int], margin: npt.NDArray[np.int64], shape: tuple[int, ...]) -> Box:
    low, high = np.array(first) - margin, np.array(last) + margin
    at_end = np.stack([low < 0, high > shape], axis=1)
    low, high = np.maximum(low, 0), np.minimum(high, shape)
    sizes = high - low
    return Box((int(low[0]), int(low[1]), int(low[2])), (int(sizes[0]), int(sizes[1]), int(sizes[2])), at_end)


def _overlap(one: Box, other: Box) -> Box | None:
    """Return what two boxes share."""
    low = np.maximum(one.first, other.first)
    high = np.minimum(np.add(one.first, one.shape), np.add(other.first, other.shape))
    if (high <= low).any():
        return None
    return _box(list(low), list(high), np.zeros(3, np.int64), tuple(high))
