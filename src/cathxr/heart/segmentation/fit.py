"""Fitting the atlas to a scan: where the heart is, how large and turned, then how it is bent."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import ndimage, signal

from cathxr.core import DataError, FloatArray
from cathxr.heart.segmentation.atlas import Atlas
from cathxr.heart.segmentation.images import grid_points, smoothed, upright_at
from cathxr.heart.segmentation.sampling import sampled
from cathxr.heart.volume import Grid

_SCALES = (0.78, 0.88, 1.0, 1.12, 1.26)
_SEARCH_MM = 6.0
_BEST = 3
_AFFINE_BLURS_MM = (6.0, 3.0)
_ARM_MM = 40.0
_AFFINE_ROUNDS = 60
_REGION_MM = 4.0
_STEP_MM = 4.0
_EDGE_PER_MM = 0.03
_BENDING = ((5.0, 24.0, 12), (3.5, 18.0, 12), (2.5, 13.0, 12))
"""Blur of the pictures, smoothing of each step, mm, and number of steps: coarse first."""


@dataclass(frozen=True, eq=False)
class Fit:
    """places_mm (3, K, J, I): where each voxel of `grid` lies in the atlas (x, y, z).

    difference: mean square of the two blood pools' difference after the affine part, each between 0 and 1.
    """

    places_mm: npt.NDArray[np.float32]
    grid: Grid
    difference: float

    def index_in(self, atlas_grid: Grid, grid: Grid) -> npt.NDArray[np.float32]:
        """Return the atlas's voxel coordinates (3, K, J, I; in the order k, j, i) of an upright grid's voxels."""
        at = grid.to_ct(np.zeros(3)) - self.grid.to_ct(np.zeros(3))
        steps = [
            (offset + np.arange(size) * grid.spacing_mm[0]) / self.grid.spacing_mm[0]
            for offset, size in zip(at[::-1], grid.shape, strict=True)
        ]
        index = np.meshgrid(*steps, indexing="ij")
        places = sampled(self.places_mm, np.stack(index).astype(np.float32))
        origin, spacing = atlas_grid.ct_from_voxel[:3, 3], atlas_grid.spacing_mm[0]
        return np.stack([(places[axis] - origin[axis]) / spacing for axis in (2, 1, 0)]).astype(np.float32)


def looked_up(atlas_values: npt.NDArray[np.float32], index: npt.NDArray[np.float32]) -> npt.NDArray[np.float32]:
    """Return the atlas's values (C, …) of (C, K, J, I) at its voxel coordinates (3, …), those of its edge beyond it."""
    return sampled(atlas_values, index)


def fit_atlas(atlas: Atlas, blood: npt.NDArray[np.float32], grid: Grid, pairs: FloatArray | None = None) -> Fit:
    """Return how the atlas fits.

    blood (K, J, I): share of blood, 0 to 1, on an upright grid of about 2 mm. pairs (N, 2, 3): points of the scan and
    of the atlas, mm, that are to lie near each other (at least three start the search); None without.

    Raises:
        DataError: nothing in the scan looks like a heart.
    """
    starts = _starts(atlas, blood, grid) if pairs is None or len(pairs) < 3 else [_start_of(pairs)]
    best, cost = starts[0], np.inf
    for blur in _AFFINE_BLURS_MM:
        image = _blurred(blood, grid, blur)
        fitted = [_affine(atlas, image, grid, start, blur) for start in starts]
        best, cost = min(fitted, key=lambda each: each[1])
        starts = [best]
    region = _region(atlas, grid, best)
    index = np.moveaxis(grid.to_voxel(grid_points(region)), -1, 0)[::-1]
    places = grid_points(region) @ np.linalg.inv(best)[:3, :3].T + np.linalg.inv(best)[:3, 3]
    bent = np.moveaxis(places, -1, 0).astype(np.float32)
    for blur, smoothing, rounds in _BENDING:
        coarse = sampled(_blurred(blood, grid, blur)[None], index, nearest_beyond=False)[0]
        bent = _bent(atlas, coarse, region, bent, (blur, smoothing, rounds))
    return Fit(bent, region, float(cost))


def _blurred(values: npt.NDArray[np.float32], grid: Grid, blur_mm: float) -> npt.NDArray[np.float32]:
    """Return the values (K, J, I) smoothed by a Gaussian of this standard deviation."""
    return smoothed(values, blur_mm / grid.spacing_mm[::-1])


def _starts(atlas: Atlas, blood: npt.NDArray[np.float32], grid: Grid) -> list[FloatArray]:
    """Return the likeliest scalings and shifts from atlas to scan: where atlas and blood correlate most."""
    coarse = _at_spacing(blood, grid.spacing_mm[0])
    found = []
    for scale in _SCALES:
        template, weight, centre = _template(atlas, _SEARCH_MM / scale)
        score = _correlation(coarse, template, weight)
        for _ in range(2):
            at = [int(index) for index in np.unravel_index(int(score.argmax()), score.shape)]
            found.append((float(score[tuple(at)]), scale, np.array(at, float), centre))
            around = tuple(slice(max(index - 4, 0), index + 5) for index in at)
            score[around] = -1.0
    found.sort(key=lambda each: -each[0])
    if not found or found[0][0] < 0.2:
        raise DataError(
            "Nothing in the scan looks like a contrast-filled heart; "
            "give a scan of the heart, or a ready mask with --labels."
        )
    starts = []
    for _, scale, voxel, centre in found[:_BEST]:
        place = grid.to_ct(voxel[::-1] * _SEARCH_MM / grid.spacing_mm[0])
        starts.append(_matrix(np.eye(3) * scale, centre, place))
    return starts


def _at_spacing(blood: npt.NDArray[np.float32], spacing_mm: float) -> npt.NDArray[np.float32]:
    """Return the share of blood on the search's coarse grid, its first voxel where the fine one's is."""
    sigma = 0.45 * _SEARCH_MM / spacing_mm
    smooth = ndimage.gaussian_filter(blood, sigma)
    steps = [np.arange(0.0, size, _SEARCH_MM / spacing_mm) for size in blood.shape]
    index = np.meshgrid(*steps, indexing="ij")
    return np.asarray(ndimage.map_coordinates(smooth, index, order=1, mode="nearest"), np.float32)


def _template(atlas: Atlas, spacing_mm: float) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32], FloatArray]:
    """Return the atlas's blood and where it counts, on `spacing_mm` of its own, and its middle voxel's place mm."""
    own = atlas.labels.grid
    low, high = own.to_ct(np.zeros(3)), own.to_ct(np.asarray(own.shape[::-1]) - 1.0)
    half = np.ceil((high - low) / 2.0 / spacing_mm).astype(int)
    centre = (low + high) / 2.0
    steps = [np.arange(-count, count + 1) * spacing_mm for count in half[::-1]]
    k, j, i = np.meshgrid(*steps, indexing="ij")
    at = own.to_voxel(np.stack([i, j, k], axis=-1) + centre)
    index = np.moveaxis(at, -1, 0)[::-1]
    sigma = 0.45 * spacing_mm / own.spacing_mm[0]
    blood = ndimage.gaussian_filter(atlas.blood.astype(np.float32), sigma)
    heart = ndimage.gaussian_filter(atlas.near.astype(np.float32), sigma)
    values = ndimage.map_coordinates(blood, index, order=1, mode="constant")
    weight = ndimage.map_coordinates(heart, index, order=1, mode="constant")
    return values.astype(np.float32), weight.astype(np.float32), centre


def _correlation(
    image: npt.NDArray[np.float32], template: npt.NDArray[np.float32], weight: npt.NDArray[np.float32]
) -> npt.NDArray[np.float64]:
    """Return the weighted normalised correlation of the template centred at each of the image's voxels."""
    total = weight.sum()
    mean = (weight * template).sum() / total
    spread = np.sqrt((weight * (template - mean) ** 2).sum() / total)
    zero_mean = weight * (template - mean)

    def slid(kernel: npt.NDArray[np.float32], over: npt.NDArray[np.float32]) -> npt.NDArray[np.float64]:
        padded = np.pad(over, [(size // 2, size // 2) for size in kernel.shape])
        return np.asarray(signal.fftconvolve(padded, kernel[::-1, ::-1, ::-1], mode="valid"), float)

    local_mean = slid(weight, image) / total
    local_square = slid(weight, image * image) / total
    deviation = np.sqrt(np.maximum(local_square - local_mean**2, 1e-4))
    return np.asarray(slid(zero_mean, image) / (total * spread * np.maximum(deviation, 0.1)))


def _start_of(pairs: FloatArray) -> FloatArray:
    """Return the similarity from atlas to scan that brings the pairs of points nearest (Umeyama 1991)."""
    scan, own = pairs[:, 0], pairs[:, 1]
    scan_middle, own_middle = scan.mean(axis=0), own.mean(axis=0)
    u, singular, vt = np.linalg.svd((scan - scan_middle).T @ (own - own_middle))
    sign = np.diag([1.0, 1.0, float(np.sign(np.linalg.det(u @ vt)))])
    turn = u @ sign @ vt
    scale = float((singular * np.diag(sign)).sum() / max(((own - own_middle) ** 2).sum(), 1e-9))
    return _matrix(turn * np.clip(scale, 0.6, 1.6), own_middle, scan_middle)


def _matrix(linear: FloatArray, own: FloatArray, scan: FloatArray) -> FloatArray:
    """Return the transform (4, 4) with this linear part that takes the point `own` to `scan`."""
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = scan - linear @ own
    return matrix


def _region(atlas: Atlas, grid: Grid, scan_from_atlas: FloatArray) -> Grid:
    """Return the grid of the bending: about the fitted atlas, as coarse as the bending is smooth."""
    own = atlas.labels.grid
    last = np.asarray(own.shape[::-1]) - 1.0
    corners = own.to_ct([(a, b, c) for a in (0, last[0]) for b in (0, last[1]) for c in (0, last[2])])
    moved = corners @ scan_from_atlas[:3, :3].T + scan_from_atlas[:3, 3]
    high_of_scan = grid.to_ct(np.asarray(grid.shape[::-1]) - 1.0)
    low = np.maximum(moved.min(axis=0), grid.to_ct(np.zeros(3)))
    high = np.minimum(moved.max(axis=0), high_of_scan)
    return upright_at(low, np.maximum(np.floor((high - low) / _REGION_MM).astype(int) + 1, 2), _REGION_MM)


def _affine(
    atlas: Atlas, image: npt.NDArray[np.float32], grid: Grid, start: FloatArray, blur_mm: float
) -> tuple[FloatArray, float]:
    """Return the affine transform (4, 4) from atlas to scan, and the mean squared difference of the two blood pools.

    Levenberg-Marquardt on the differences at the atlas's voxels, every second along each axis.
    """
    own = atlas.labels.grid
    some = (slice(None, None, 2),) * 3
    near = atlas.near[some]
    k, j, i = np.nonzero(near)
    points = own.to_ct(2.0 * np.stack([i, j, k], axis=-1))
    wanted = _blurred(atlas.blood.astype(np.float32), own, blur_mm)[some][near]
    weight = atlas.weight[some][near]
    middle = points.mean(axis=0)
    basis = np.column_stack([(points - middle) / _ARM_MM, np.ones(len(points))])
    slopes = np.stack([np.asarray(each, np.float32) for each in np.gradient(image, grid.spacing_mm[0])][::-1])
    parameters = np.column_stack([start[:3, :3] * _ARM_MM, start[:3, :3] @ middle + start[:3, 3]])

    def in_scan(values: npt.NDArray[np.float32], at: FloatArray) -> FloatArray:
        return sampled(values, grid.to_voxel(at).T[::-1], nearest_beyond=False).astype(float)

    def cost_of(trial: FloatArray) -> tuple[FloatArray, float]:
        residual = in_scan(image[None], basis @ trial.T)[0] - wanted
        return residual, float((weight * residual**2).sum() / weight.sum())

    residual, cost = cost_of(parameters)
    damping = 1e-2
    for _ in range(_AFFINE_ROUNDS):
        at = basis @ parameters.T
        slope = in_scan(slopes, at).T
        jacobian = (slope[:, :, None] * basis[:, None, :]).reshape(len(points), 12)
        normal = jacobian.T @ (weight[:, None] * jacobian)
        downhill = jacobian.T @ (weight * residual)
        moved = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), downhill).reshape(3, 4)
        new_residual, new_cost = cost_of(parameters - moved)
        if new_cost < cost:
            parameters, residual, damping = parameters - moved, new_residual, max(damping * 0.3, 1e-4)
            settled = cost - new_cost < 1e-4 * cost
            cost = new_cost
            if settled:
                break
        else:
            damping *= 5.0
    matrix = np.eye(4)
    matrix[:3, :3] = parameters[:, :3] / _ARM_MM
    matrix[:3, 3] = parameters[:, 3] - matrix[:3, :3] @ middle
    return matrix, cost


def _bent(
    atlas: Atlas,
    image: npt.NDArray[np.float32],
    grid: Grid,
    places: npt.NDArray[np.float32],
    level: tuple[float, float, int],
) -> npt.NDArray[np.float32]:
    """Return each voxel's place (3, K, J, I) mm in the atlas, in the order x, y, z, bent further from `places`.

    level: blur mm of both pictures, smoothing mm of each step, number of steps. Thirion's demons ("Image matching as a
    diffusion process", 1998), forces weighted by how much the atlas is to be believed where they act.
    """
    blur_mm, smoothing_mm, rounds = level
    own = atlas.labels.grid
    blur = _blurred(atlas.blood.astype(np.float32), own, blur_mm)
    slopes = [np.asarray(each, np.float32) for each in np.gradient(blur, own.spacing_mm[0])][::-1]
    origin = own.ct_from_voxel[:3, 3].astype(np.float32)[:, None, None, None]
    spacing = np.float32(own.spacing_mm[0])
    pictures = np.stack([blur, *slopes, atlas.weight * atlas.near])
    sigma = smoothing_mm / grid.spacing_mm[::-1]
    for _ in range(rounds):
        index = ((places - origin) / spacing)[::-1]
        looked = sampled(pictures, index, nearest_beyond=False)
        difference, slope, weight = looked[0] - image, looked[1:4], looked[4]
        strength = (slope**2).sum(axis=0)
        force = weight * difference * slope / (strength + (difference / _STEP_MM) ** 2 + 1e-5)
        # Averaged over where there are edges at all: the flat insides of the pools must not thin the step.
        edges = weight * strength / (strength + _EDGE_PER_MM**2)
        total = smoothed(edges, sigma) + np.float32(0.02)
        places = places - np.stack([smoothed(each, sigma) for each in force]) / total
    return places
