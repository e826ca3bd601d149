"""Surfaces: analytic shapes through reading, opening, smoothing, simplifying, lumen, GLB."""

import importlib.util
import struct
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from cathxr.core import DataError
from cathxr.heart.glb import Part, ct_from_gltf, encode_glb, gltf_from_ct, node_names, read_glb, surface
from cathxr.heart.lumen import lumen
from cathxr.heart.simplify import simplified
from cathxr.heart.surface import (
    Surface,
    enclosed_volume_ml,
    largest_component,
    open_at,
    read_stl,
    rim_edges,
    smoothed,
    vertex_normals,
)

HAS_SIMPLIFIER = importlib.util.find_spec("fast_simplification") is not None
needs_simplifier = pytest.mark.skipif(
    not HAS_SIMPLIFIER, reason="the extra `heart` (fast-simplification) is not installed"
)


def sphere(radius_mm: float = 20.0, bands: int = 40, turns: int = 60) -> Surface:
    """A closed sphere with a fan of triangles at each pole, like the capped blood pools."""
    polar = np.arange(1, bands) * np.pi / bands
    angle = np.arange(turns) * 2 * np.pi / turns
    ring = np.stack(
        [
            np.outer(np.sin(polar), np.cos(angle)),
            np.outer(np.sin(polar), np.sin(angle)),
            np.outer(np.cos(polar), np.ones(turns)),
        ],
        axis=-1,
    ).reshape(-1, 3)
    vertices = radius_mm * np.concatenate([ring, [[0, 0, 1.0]], [[0, 0, -1.0]]])
    top, bottom = len(vertices) - 2, len(vertices) - 1
    triangles = []
    for turn in range(turns):
        following = (turn + 1) % turns
        triangles.append([top, turn, following])
        last = (bands - 2) * turns
        triangles.append([bottom, last + following, last + turn])
        for band in range(bands - 2):
            a, b = band * turns + turn, band * turns + following
            triangles += [[a, a + turns, b + turns], [a, b + turns, b]]
    return Surface(vertices, np.array(triangles))


def pipe(inner_mm: float, outer_mm: float, length_mm: float, turns: int = 48) -> Surface:
    """A closed, thick-walled straight pipe along +z whose outer side is jagged."""
    generator = np.random.default_rng(5)
    angle = np.arange(turns) * 2 * np.pi / turns
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(turns)], axis=1)
    heights = np.linspace(0.0, length_mm, 21)[:, None, None] * [0, 0, 1.0]
    inner = (inner_mm * around + heights).reshape(-1, 3)
    radii = outer_mm + generator.uniform(-0.5, 0.5, (21, turns, 1))
    outer = (radii * around + heights).reshape(-1, 3)
    triangles = []
    count = len(inner)
    for turn in range(turns):
        following = (turn + 1) % turns
        for ring in range(20):
            a, b = ring * turns + turn, ring * turns + following
            c, d = a + turns, b + turns
            triangles += [[a, d, b], [a, c, d], [count + a, count + b, count + d], [count + a, count + d, count + c]]
        top = 20 * turns
        triangles += [[turn, following, count + following], [turn, count + following, count + turn]]
        low, high = top + turn, top + following
        triangles += [[low, count + high, high], [low, count + low, count + high]]
    return Surface(np.concatenate([inner, outer]), np.array(triangles))


def distance_to(shape: Surface, points: np.ndarray) -> np.ndarray:
    """Distance (N,) mm from points to a surface, to the nearest of 16 candidate triangles around each."""
    corners = shape.vertices_mm[shape.triangles]
    _, nearest = cKDTree(corners.mean(axis=1)).query(points, k=16)
    a, b, c = (corners[nearest][:, :, at] for at in range(3))
    p = points[:, None]
    best = np.full(nearest.shape, np.inf)
    for u, v in ((a, b), (b, c), (c, a)):
        along = v - u
        share = np.clip(((p - u) * along).sum(-1) / (along**2).sum(-1), 0.0, 1.0)
        best = np.minimum(best, np.linalg.norm(p - u - share[..., None] * along, axis=-1))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    height = ((p - a) * normal).sum(-1)
    foot = p - height[..., None] * normal
    inside = np.all([(np.cross(v - u, foot - u) * normal).sum(-1) >= 0 for u, v in ((a, b), (b, c), (c, a))], axis=0)
    return np.asarray(np.where(inside, np.abs(height), best).min(axis=1))


def stl_bytes(shape: Surface) -> bytes:
    records = b"".join(
        struct.pack("<12fH", 0, 0, 0, *corners.reshape(-1), 0) for corners in shape.vertices_mm[shape.triangles]
    )
    return bytes(80) + struct.pack("<I", len(shape.triangles)) + records


def test_stl_is_welded(tmp_path: Path) -> None:
    ball = sphere()
    (tmp_path / "ball.stl").write_bytes(stl_bytes(ball))
    read = read_stl(tmp_path / "ball.stl")
    assert len(read.vertices_mm) == len(ball.vertices_mm)
    assert len(rim_edges(read)) == 0
    assert enclosed_volume_ml(read) == pytest.approx(enclosed_volume_ml(ball), rel=1e-6)  # float32 corners


@pytest.mark.parametrize("content", [b"", b"solid ascii", bytes(84), stl_bytes(sphere())[:-7]])
def test_bad_stl_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bad.stl"
    path.write_bytes(content)
    with pytest.raises(DataError, match="not a complete binary STL"):
        read_stl(path)


def test_volume_of_a_sphere_closed_and_open() -> None:
    ball = sphere()
    exact = 4 / 3 * np.pi * 20.0**3 / 1000
    # 40 x 60 flat facets lie inside the sphere: the volume is low by about (pi/40)^2/3 + (2 pi/60)^2/6 = 0.4 %.
    assert enclosed_volume_ml(ball) == pytest.approx(exact, rel=0.006)
    opened, normal = open_at(ball, np.array([0.0, 0.0, 20.0]))
    assert np.allclose(normal, [0, 0, 1], atol=1e-9)
    assert len(rim_edges(opened)) == 60
    cap = np.pi * (20 - 20 * np.cos(np.pi / 40)) ** 2 * (60 - 20 + 20 * np.cos(np.pi / 40)) / 3 / 1000
    assert enclosed_volume_ml(opened) == pytest.approx(enclosed_volume_ml(ball) - cap, rel=1e-4)
    with pytest.raises(DataError, match="No vertex closes the opening"):
        open_at(ball, np.array([0.0, 0.0, 25.0]))


def test_smoothing_takes_noise_away_and_keeps_the_volume() -> None:
    ball = open_at(sphere(), np.array([0.0, 0.0, 20.0]))[0]
    noisy = Surface(
        ball.vertices_mm + np.random.default_rng(1).normal(0.0, 0.15, ball.vertices_mm.shape), ball.triangles
    )
    fair = smoothed(noisy, 20)
    roughness = [
        float(np.std(np.linalg.norm(each.vertices_mm[300:-300], axis=1) - 20.0)) for each in (noisy, fair)
    ]  # away from the rims and poles
    assert roughness[1] < 0.6 * roughness[0]
    assert enclosed_volume_ml(fair) == pytest.approx(enclosed_volume_ml(ball), rel=0.01)


def test_normals_of_a_sphere_are_its_radii() -> None:
    ball = sphere()
    radii = ball.vertices_mm / 20.0
    # Facets span at most 6 degrees; angle weighting leaves well under a tenth of that.
    assert np.degrees(np.arccos(np.clip((vertex_normals(ball) * radii).sum(axis=1), -1, 1))).max() < 0.6


def test_largest_component_drops_the_rest() -> None:
    big, small = sphere(), sphere(5.0, 10, 12)
    both = Surface(
        np.concatenate([small.vertices_mm + 100.0, big.vertices_mm]),
        np.concatenate([small.triangles, big.triangles + len(small.vertices_mm)]),
    )
    assert len(largest_component(both).triangles) == len(big.triangles)


def test_lumen_of_a_jagged_pipe_is_its_inner_side() -> None:
    tube = lumen(pipe(10.0, 12.5, 40.0), np.zeros(3), np.array([0.0, 0.0, 1.0]), straight_mm=35.0, rings=12)
    radius = np.hypot(tube.vertices_mm[:, 0], tube.vertices_mm[:, 1])
    # 48 flat sides: the inner side's radius varies from 10 cos(pi/48) = 9.979 to 10; the jagged outer side, which
    # moves the fitted axis by a few hundredths, starts at 12.
    assert np.abs(radius - 9.99).max() < 0.08
    assert tube.vertices_mm[:, 2].min() == pytest.approx(0.0, abs=0.6)  # sampled every 0.5 mm
    assert tube.vertices_mm[:, 2].max() == pytest.approx(40.0, abs=0.6)
    outward = (vertex_normals(tube)[:, :2] * tube.vertices_mm[:, :2]).sum(axis=1)
    assert (outward > 0).all()
    assert enclosed_volume_ml(tube) == pytest.approx(np.pi * 100 * 40 / 1000, rel=0.03)


def test_lumen_needs_a_wall_all_round() -> None:
    whole = pipe(10.0, 12.5, 40.0)
    half = whole.keep(whole.vertices_mm[whole.triangles].mean(axis=1)[:, 0] > 0.0)
    with pytest.raises(DataError, match="does not surround"):
        lumen(half, np.array([-30.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0]), straight_mm=35.0, rings=12)


def test_glb_round_trip_and_same_bytes(tmp_path: Path) -> None:
    ball = sphere()
    part = Part("ball", ball.vertices_mm, vertex_normals(ball), ball.triangles, "#336699", 0.5)
    data = encode_glb([part], "someone", "test")
    assert data == encode_glb([part], "someone", "test")
    (tmp_path / "ball.glb").write_bytes(data)
    document, binary = read_glb(tmp_path / "ball.glb")
    assert node_names(document, tmp_path) == ("ball",)
    vertices, triangles = surface(document, binary, "ball")
    assert np.array_equal(triangles, ball.triangles)
    assert np.abs(vertices - ball.vertices_mm).max() < 2e-6  # float32 of 0.02 m, in mm
    with pytest.raises(DataError, match="no node named 'cube'"):
        surface(document, binary, "cube")
    with pytest.raises(ValueError, match="different node names"):
        encode_glb([part, part], "someone", "test")


def test_gltf_frame_is_the_architectures() -> None:
    assert np.allclose(gltf_from_ct(np.array([1000.0, 2000.0, 3000.0])), [1.0, 3.0, -2.0])
    points = np.random.default_rng(0).normal(0, 100, (50, 3))
    assert np.allclose(ct_from_gltf(gltf_from_ct(points)), points, atol=1e-10)


@needs_simplifier
def test_simplified_sphere_stays_a_sphere() -> None:
    ball = sphere()
    light = simplified(ball, 1000)
    assert len(light.triangles) <= 1100
    assert len(rim_edges(light)) == 0
    # A triangle of edge s on radius r sags s^2 / (8 r) = 0.1 mm at 1000 triangles (s = 3.4 mm); allowed: three times.
    assert distance_to(light, ball.vertices_mm).max() < 0.3
    assert simplified(ball, 10**6) is ball
