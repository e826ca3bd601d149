from collections import deque

import cv2
import numpy as np
import pytest

from cathxr.vision.paper_skeleton import farthest_path, skeleton_path, thin


def curved_mask(seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    mask = np.zeros((120, 200), dtype=np.uint8)
    x = np.linspace(5, 180, 60)
    y = 60 + 35 * np.sin(x / random.uniform(25, 60) + random.uniform(0, 6))
    cv2.polylines(mask, [np.column_stack([x, y]).round().astype(np.int32)], False, 255, int(random.integers(3, 14)))
    return mask


def plain_distances(skeleton: np.ndarray, start: tuple[int, int]) -> dict[tuple[int, int], int]:
    """Breadth-first search as in any textbook."""
    distance = {start: 0}
    queue = deque([start])
    while queue:
        row, column = queue.popleft()
        for i in (-1, 0, 1):
            for j in (-1, 0, 1):
                there = (row + i, column + j)
                if skeleton[there] and there not in distance:
                    distance[there] = distance[row, column] + 1
                    queue.append(there)
    return distance


@pytest.mark.parametrize("seed", range(8))
def test_thinning_is_guo_and_halls(seed: int) -> None:
    mask = np.pad(curved_mask(seed), 1)
    expected = cv2.ximgproc.thinning(mask, thinningType=cv2.ximgproc.THINNING_GUOHALL)
    thin(mask)
    np.testing.assert_array_equal(mask, expected)


@pytest.mark.parametrize("seed", range(8))
def test_the_path_is_a_shortest_one_to_the_farthest_pixel(seed: int) -> None:
    skeleton = np.pad(curved_mask(seed), 1)
    thin(skeleton)
    rows, columns = np.nonzero(skeleton)
    first = int(np.argmin(columns))
    start = (int(rows[first]), int(columns[first]))
    flat = farthest_path(skeleton, *start)
    path = [(int(each) // skeleton.shape[1], int(each) % skeleton.shape[1]) for each in flat]
    distance = plain_distances(skeleton, start)
    assert path[-1] == start
    assert len(path) - 1 == max(distance.values()) == distance[path[0]]
    assert [distance[each] for each in path] == list(range(len(path) - 1, -1, -1))


def test_a_straight_bar_gives_its_middle_line_tip_first() -> None:
    mask = np.zeros((31, 90), dtype=np.uint8)
    mask[11:20, 0:80] = 255
    path = skeleton_path(mask)
    # Nine rows have their middle at row 15; thinning takes at most one half width, 4.5 px, off each end.
    assert np.abs(path[5:-5, 1] - 15).max() <= 1.0
    assert 79 - 5 <= path[0, 0] <= 79
    assert path[-1, 0] <= 5


def test_nothing_gives_no_path() -> None:
    assert skeleton_path(np.zeros((10, 10), dtype=np.uint8)).shape == (0, 2)
