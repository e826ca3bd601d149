"""The compiled loops against plain references."""

import numpy as np
import pytest
from scipy import ndimage, sparse
from scipy.sparse.linalg import spsolve

from cathxr.heart.segmentation.cutting import least_cut
from cathxr.heart.segmentation.distances import closed, distance_to, distance_within, nearest_in, opened
from cathxr.heart.segmentation.flooding import flooded_from
from cathxr.heart.segmentation.sampling import largest_two, sampled
from cathxr.heart.segmentation.walking import graph_of, settled

SHAPE = (11, 14, 9)
SAMPLING_MM = np.array([1.5, 0.7, 0.9])


def blobs(seed: int, least: float = 0.06) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(size=SHAPE)
    return np.asarray(ndimage.gaussian_filter(noise, 1.2) > least)


@pytest.mark.parametrize("seed", range(4))
def test_distances_are_those_of_scipy(seed: int) -> None:
    mask = blobs(seed)
    assert 0 < mask.sum() < mask.size
    expected = ndimage.distance_transform_edt(~mask, sampling=SAMPLING_MM)
    assert np.allclose(distance_to(mask, SAMPLING_MM), expected, atol=1e-5)  # single precision of some 10 mm
    assert np.allclose(
        distance_within(mask, SAMPLING_MM), ndimage.distance_transform_edt(mask, sampling=SAMPLING_MM), atol=1e-5
    )
    distance, index = nearest_in(mask, SAMPLING_MM)
    assert mask.ravel()[index].all()
    places = np.stack(np.unravel_index(index, SHAPE)) - np.indices(SHAPE)
    assert np.allclose(np.linalg.norm(places * SAMPLING_MM[:, None, None, None], axis=0), distance, atol=1e-5)


def test_an_empty_mask_is_far_away() -> None:
    distance, index = nearest_in(np.zeros(SHAPE, bool), 1.0)
    assert (distance > 1e6).all()
    assert (index == -1).all()
    assert not opened(np.zeros(SHAPE, bool), 2.0, 1.0).any()


def test_opening_takes_off_what_a_ball_does_not_reach_and_closing_fills_it() -> None:
    k, j, i = np.indices((24, 24, 24)) - 11.5
    body = k**2 + j**2 + i**2 < 64.0
    spike = (np.abs(j) < 1.0) & (np.abs(i) < 1.0) & (k > 0.0)
    assert not (opened(body | spike, 4.0, 1.0) & spike & (k > 9.0)).any()
    assert opened(body | spike, 4.0, 1.0)[12, 12, 12]
    assert closed(body & ~spike, 2.0, 1.0)[14, 12, 12]


def test_samples_are_those_of_scipy() -> None:
    rng = np.random.default_rng(2)
    values = rng.normal(size=(3, *SHAPE)).astype(np.float32)
    index = rng.uniform(-3.0, 16.0, size=(3, 500)).astype(np.float32)
    for nearest, mode in ((True, "nearest"), (False, "constant")):
        expected = [ndimage.map_coordinates(each, index, order=1, mode=mode) for each in values]
        assert np.allclose(sampled(values, index, nearest_beyond=nearest), expected, atol=1e-5)


def test_the_largest_two_are_those_of_the_samples() -> None:
    rng = np.random.default_rng(3)
    values = rng.uniform(0.1, 1.0, size=(4, *SHAPE)).astype(np.float32)
    matrix = np.array([[0.6, 0.05, 0.0, -1.0], [0.0, 0.7, 0.1, 0.5], [0.02, 0.0, 0.8, 0.3]])
    mask = rng.random((12, 13, 10)) > 0.4
    best, lead = largest_two(values, mask, matrix)
    voxels = np.argwhere(mask)
    index = matrix[:, :3] @ voxels.T + matrix[:, 3:]
    found = sampled(values, index.astype(np.float32), nearest_beyond=False)
    within = found.sum(axis=0) > 0.0
    ordered = np.sort(found, axis=0)
    assert (best[mask][within] == found.argmax(axis=0)[within] + 1).all()
    assert np.allclose(lead[mask][within], (ordered[-1] - ordered[-2])[within], atol=1e-5)
    assert (best[mask][~within] == 4).all()
    assert (lead[mask][~within] == 1.0).all()
    assert not best[~mask].any()


def test_walks_settle_where_the_equations_do() -> None:
    rng = np.random.default_rng(4)
    share = ndimage.gaussian_filter(rng.normal(size=SHAPE), 1.0) * 2.0 + 0.8
    nodes = blobs(4, -0.1)
    neighbours, conductances = graph_of(share.astype(np.float32), nodes, steepness=30.0, least=3e-4)
    count = len(neighbours)
    rows = np.repeat(np.arange(count), 6)[neighbours.ravel() >= 0]
    columns, weights = neighbours.ravel()[neighbours.ravel() >= 0], conductances.ravel()[neighbours.ravel() >= 0]
    graph = sparse.coo_matrix((weights.astype(float), (rows, columns)), (count, count))
    assert abs(graph - graph.T).max() == 0.0
    voxels = np.argwhere(nodes)
    assert (np.abs(voxels[rows] - voxels[columns]).sum(axis=1) == 1).all()
    pull = np.full(count, 0.02)
    wanted = (voxels[:, 0] > 5).astype(float)
    system = sparse.diags(np.asarray(graph.sum(axis=1)).ravel() + pull) - graph
    expected = spsolve(system.tocsc(), pull * wanted)
    # The residual is a thousandth of what is asked for; the stiffest part of the graph answers with some of it more.
    assert np.allclose(settled(neighbours, conductances, pull, wanted), expected, atol=0.02)


def test_floods_meet_on_the_ridge() -> None:
    landscape = np.zeros((3, 5, 21), np.uint16)
    landscape[:, :, 13] = 100
    markers = np.zeros(landscape.shape, np.uint8)
    markers[1, 2, 0], markers[1, 2, 20] = 1, 2
    mask = np.ones(landscape.shape, bool)
    mask[:, :, 4] = False
    mask[1, 2, 4] = True  # a narrow gate is no obstacle
    flooded = flooded_from(landscape, markers, mask)
    assert (flooded[:, :, :13][mask[:, :, :13]] == 1).all()
    assert (flooded[:, :, 14:] == 2).all()
    assert not flooded[~mask].any()


def test_the_least_cut_goes_through_the_neck() -> None:
    k, j, i = np.indices((20, 20, 50)).astype(np.float32)
    radius = np.where(np.abs(i - 30.0) < 2.0, 3.0, 8.0)
    mask = (k - 9.5) ** 2 + (j - 9.5) ** 2 < radius**2
    # The atlas has the border at 25, five voxels off.
    part = least_cut(mask, (0.02 * np.clip(i - 25.0, -8.0, 8.0)).astype(np.float32), 1.0)
    assert part[mask & (i < 29)].all()
    assert not part[mask & (i > 31)].any()


def test_the_least_cut_goes_along_a_wall() -> None:
    k, j, i = np.indices((16, 16, 40)).astype(np.float32)
    mask = (k - 7.5) ** 2 + (j - 7.5) ** 2 < 36.0
    dear = np.where(np.abs(i - 12.0) < 1.0, np.float32(0.05), np.float32(1.0))
    part = least_cut(mask, (0.01 * np.clip(i - 18.0, -8.0, 8.0)).astype(np.float32), 1.0, dear=dear)
    assert part[mask & (i < 11)].all()
    assert not part[mask & (i > 14)].any()
