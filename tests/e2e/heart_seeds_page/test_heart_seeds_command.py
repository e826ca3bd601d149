"""`cathxr heart seeds` as a real process: an askew scan, ready labels, a person at the page, a file at the end."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.seeds import Seed as HeartSeed
from cathxr.heart.seeds import read_seeds, write_seeds
from cathxr.heart.volume import LabelVolume, Volume
from tests.heart_support.phantoms import four_chambers

from .conftest import HANDLE

sitk: Any = pytest.importorskip("SimpleITK", reason="needs the extra: pip install 'cathxr[heart]'")
PATIENT = "doe_jane_1961"


@pytest.fixture(scope="module")
def scan() -> tuple[Volume, LabelVolume]:
    """A heart of 2.5 mm voxels, turned about two axes."""
    return four_chambers((56, 56, 56), (2.5, 2.5, 2.5), oblique_deg=(0.0, 20.0, 15.0))


def write_image(path: Path, voxels: np.ndarray, ct_from_voxel: np.ndarray) -> Path:
    image = sitk.GetImageFromArray(voxels)
    spacing = np.linalg.norm(ct_from_voxel[:3, :3], axis=0)
    image.SetSpacing(spacing.tolist())
    image.SetDirection((ct_from_voxel[:3, :3] / spacing).ravel().tolist())
    image.SetOrigin(ct_from_voxel[:3, 3].tolist())
    sitk.WriteImage(image, str(path))
    return path


@pytest.fixture
def files(scan: tuple[Volume, LabelVolume], tmp_path: Path) -> tuple[Path, Path, Path]:
    """The scan, its labels and their names as files in a folder that is called like a patient."""
    volume, truth = scan
    folder = tmp_path / PATIENT
    folder.mkdir()
    names = folder / "names.csv"
    names.write_text("".join(f"{label},{key}\n" for label, key in truth.names.items()))
    matrix = volume.grid.ct_from_voxel
    ct = write_image(folder / f"{PATIENT}.nii.gz", volume.hu, matrix)
    return ct, write_image(folder / "labels.nii.gz", truth.labels, matrix), names


def centre_of(truth: LabelVolume, key: str) -> np.ndarray:
    """Return the middle of a structure's voxels, mm in ct."""
    k, j, i = np.nonzero(truth.mask(key))
    return truth.grid.to_ct(np.array([i.mean(), j.mean(), k.mean()]))


def test_a_person_places_seeds_and_saves_them(
    files: tuple[Path, Path, Path], scan: tuple[Volume, LabelVolume], tmp_path: Path,
    start_seeds: Callable[..., Any], open_seeds: Callable[..., Any],
) -> None:  # fmt: skip
    ct, labels, names = files
    out = tmp_path / "seeds.csv"
    earlier = (12.0, 34.0, 56.0)
    write_seeds(out, [HeartSeed("right_atrium", earlier)])
    command = start_seeds(str(ct), "--labels", str(labels), "--names", str(names), "--out", str(out))
    watched = open_seeds(command.url)
    watched.ready()
    page = watched.page
    assert "oblique: 2" in page.locator("#tilt").inner_text()
    assert page.locator("#seeds li").count() == 1
    truth = scan[1]
    wanted = centre_of(truth, "left_atrium")
    seen_from_ct = np.linalg.inv(np.array(page.evaluate(f"() => {HANDLE}.ctFromSeen")).T)
    seen = (seen_from_ct @ [*wanted, 1.0])[:3]

    page.locator("#structures button", has_text=CATALOGUE["left_atrium"].name).first.click()
    page.locator("[data-plane=axial] input[type=range]").fill(str(round(seen[2])))
    watched.current()
    watched.click("axial", seen)
    watched.until("document.querySelectorAll('#seeds li').length === 2")
    assert "labelled" not in page.locator("#seeds li").nth(1).inner_text(), "the labels agree with the seed"
    page.get_by_role("button", name="Save seeds").click()
    watched.until(
        "document.querySelector('#advice').innerText.length > 0 && "
        "![...document.querySelectorAll('#actions button')].some((each) => each.innerText === 'Save seeds')"
    )
    page.get_by_role("button", name="Done").click()
    watched.until("!document.querySelector('#ended').hidden")
    shown = page.inner_text("body") + page.title() + " ".join(watched.requests)
    said = command.finish()
    assert command.process.returncode == 0, said
    first, placed = read_seeds(out)
    assert (first.structure, tuple(first.position_mm)) == ("right_atrium", earlier)
    assert placed.structure == "left_atrium"
    # Half a slice of 2.5 mm from the slider's whole numbers, and half a CSS pixel of under 0.5 mm in the slice.
    assert np.linalg.norm(np.asarray(placed.position_mm) - wanted) < 1.25 + 0.5
    assert (tmp_path / "seeds.csv.bak").is_file()
    assert PATIENT not in shown + said.replace(str(out), "")
    assert watched.complaints == []


@pytest.mark.proof
def test_the_segmentation_follows_a_seed(
    files: tuple[Path, Path, Path], scan: tuple[Volume, LabelVolume], tmp_path: Path,
    start_seeds: Callable[..., Any], open_seeds: Callable[..., Any],
) -> None:  # fmt: skip
    out = tmp_path / "seeds.csv"
    wanted = centre_of(scan[1], "left_ventricle")
    write_seeds(out, [HeartSeed("left_ventricle", (float(wanted[0]), float(wanted[1]), float(wanted[2])))])
    command = start_seeds(str(files[0]), "--out", str(out))
    watched = open_seeds(command.url)
    watched.ready()
    watched.until(f"{HANDLE}.stage !== 'segmenting'", within_s=600.0)
    assert watched.page.evaluate(f"() => {HANDLE}.stage") == "ready", watched.page.inner_text("#advice")
    assert "labelled" not in watched.page.locator("#seeds").inner_text()
    watched.page.get_by_role("button", name="Done").click()
    assert "1 seed is saved." in command.finish()
