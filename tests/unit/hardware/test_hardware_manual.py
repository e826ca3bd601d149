"""The building manual: what is in the repository is what the command makes, and its pictures mean what they say."""

import re
from pathlib import Path
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
from click.testing import CliRunner

from cathxr.app.cli import main
from cathxr.app.hardware_tables import figures_text
from cathxr.calibration import picture_checks
from cathxr.hardware.dimensions import dimension_across
from cathxr.hardware.labels import with_labels
from cathxr.hardware.layout import Layout
from cathxr.hardware.render import Drawn, picture, smooth_normals, view_axes
from cathxr.hardware.wiring import wiring_svg


def _tube(facets: int = 24) -> np.ndarray:
    """Return the side of a cylinder along z (F, 3, 3), radius 1, height 1."""
    angle = 2.0 * np.pi * np.arange(facets + 1) / facets
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(facets + 1)])
    low, high = ring, ring + np.array([0.0, 0.0, 1.0])
    return np.concatenate([
        np.stack([low[:-1], low[1:], high[1:]], axis=1), np.stack([low[:-1], high[1:], high[:-1]], axis=1),
    ])  # fmt: skip


def test_a_tube_is_shaded_round_and_a_block_is_not() -> None:
    triangles = _tube()
    outwards = triangles * (1.0, 1.0, 0.0)
    assert np.abs(smooth_normals(triangles) - outwards).max() < 0.08  # within half a facet of 15 degrees
    square = smooth_normals(_tube(4))
    assert np.allclose(np.abs(square[..., :2]), np.sqrt(0.5))


def test_a_name_stands_beside_and_its_line_ends_on_the_thing() -> None:
    body = Drawn(_tube(), (0.8, 0.1, 0.1), "tube")
    plain = picture([Drawn(body.triangles, body.colour)], view_axes((1.0, -1.0, 0.5)), width_px=300, height_px=200)
    mask = (plain != 255).any(axis=2)
    named = with_labels(plain, {"tube": mask})
    line = (named == (158, 94, 27)).all(axis=2)
    assert line.any()
    assert (named[:, -50:].max(axis=2) < 100).any(), "a text in the margin"
    assert with_labels(plain, {"tube": np.zeros_like(mask)}).shape == plain.shape


def test_a_dimension_is_as_long_as_it_says() -> None:
    text = "".join(dimension_across(np.array([3.0, 4.0]), 25.0, 2.0))
    ends = [float(each) for each in re.findall(r"M ([\d.-]+),-?[\d.]+ L", text)]
    assert max(ends) - min(ends) == pytest.approx(25.0)
    assert ">25.0<" in text


def test_the_wiring_names_every_pin_once_and_hangs_together(default: Layout) -> None:
    texts = [each.text for each in ElementTree.fromstring(wiring_svg(default)).iter() if each.tag.endswith("text")]
    for wanted in ("D2", "D3", "5V", "A, white", "B, green", "Supply", "Top camera", "Front camera"):
        assert texts.count(wanted) == 1, wanted


def test_the_manuals_figures_and_wiring_are_those_of_the_parameters(default: Layout, repo_root: Path) -> None:
    folder = repo_root / "docs" / "build"
    assert (folder / "figures.md").read_text(encoding="utf-8") == figures_text(default), "cathxr hardware manual"
    assert (folder / "images" / "wiring.svg").read_text(encoding="utf-8") == wiring_svg(default)


def test_first_light_states_the_limits_that_are_checked(repo_root: Path) -> None:
    text = (repo_root / "docs" / "build" / "first-light.md").read_text(encoding="utf-8")
    low, high = (100.0 * each for each in picture_checks.LEVELS)
    assert f"brightest part {low:.0f} to {high:.0f} % of full scale" in text
    assert f"under {picture_checks.MOST_BLUR_PX:g} px wide" in text
    assert picture_checks.LEAST_EVENNESS == 0.5, "over half of the brightest"


def test_every_picture_of_the_manual_is_shown_and_there(repo_root: Path) -> None:
    folder = repo_root / "docs" / "build"
    pages = "".join(each.read_text(encoding="utf-8") for each in folder.glob("*.md"))
    shown = set(re.findall(r"\]\(images/([^)]+)\)", pages))
    assert shown == {each.name for each in (folder / "images").iterdir()}


@pytest.mark.proof
def test_the_command_makes_what_is_in_the_repository(repo_root: Path, tmp_path: Path) -> None:
    pytest.importorskip("build123d", reason="the extra `cad` is not installed")
    done = CliRunner().invoke(main, ["hardware", "manual", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    folder = repo_root / "docs" / "build"
    made = {each.relative_to(tmp_path) for each in tmp_path.rglob("*") if each.is_file()}
    assert {each.relative_to(folder) for each in (folder / "images").iterdir()} <= made
    for path in made:
        if path.suffix == ".png":
            ours, theirs = (cv2.imread(str(each / path)).astype(float) for each in (folder, tmp_path))
            # Other versions of libraries round otherwise: a level in the mean, an edge here and there.
            assert ours.shape == theirs.shape, path
            assert np.abs(ours - theirs).mean() < 1.0, path
        else:
            assert (folder / path).read_bytes() == (tmp_path / path).read_bytes(), path
