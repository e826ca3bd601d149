"""`cathxr heart build` as a person runs it: a CT and ready labels to a heart folder; what is refused, and how."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from cathxr.heart import read_heart

SPACING = (1.2, 1.2, 1.5)


def halves() -> np.ndarray:
    """A ball (K, J, I) cut into a ventricle (1) below and an atrium (3) above."""
    k, j, i = np.meshgrid(*(np.arange(n) - (n - 1) / 2 for n in (32, 40, 40)), indexing="ij")
    ball = (1.2 * i) ** 2 + (1.2 * j) ** 2 + (1.5 * k) ** 2 <= 18.0**2
    return np.where(ball, np.where(k < 0, 1, 3), 0).astype(np.uint8)


def write(path: Path, voxels: np.ndarray) -> Path:
    image = sitk.GetImageFromArray(voxels)
    image.SetSpacing(SPACING)
    sitk.WriteImage(image, str(path))
    return path


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cathxr", "heart", "build", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)


@pytest.fixture(scope="module")
def inputs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("inputs")
    labels = halves()
    noise = np.random.default_rng(1).normal(0.0, 20.0, labels.shape)
    tissue = np.where(labels > 0, 400, 40)
    tissue[:, :6] = -1000
    ct = write(folder / "DOE^JANE_ct.nii.gz", (tissue + noise).astype(np.int16))
    names = folder / "names.csv"
    names.write_text("value,structure\n1,left_ventricle\n3,left_atrium\n", encoding="utf-8")
    return ct, write(folder / "labels.nii.gz", labels), names


def test_a_ct_with_labels_becomes_a_heart(inputs, tmp_path):
    ct, labels, names = inputs
    done = run(ct, "--labels", labels, "--names", names, "--out", tmp_path / "heart", "--name", "Two halves")
    assert done.returncode == 0, done.stderr
    heart = read_heart(tmp_path / "heart")
    assert heart.name == "Two halves"
    voxels = halves()
    for key, value in (("left_ventricle", 1), ("left_atrium", 3)):
        expected = np.count_nonzero(voxels == value) * np.prod(SPACING) / 1000.0
        assert heart.structures[key].volume_ml == pytest.approx(expected, abs=0.01)
    assert "mitral_valve" in heart.openings
    assert "quality.html" in done.stdout
    assert "Left ventricle" in done.stdout
    # A file's name may be a patient's: it stays out of everything that is written.
    for each in (tmp_path / "heart").iterdir():
        assert b"DOE^JANE" not in each.read_bytes()
    assert [each.name for each in tmp_path.iterdir()] == ["heart"]


def test_labels_alone_become_a_heart(inputs, tmp_path):
    _, labels, names = inputs
    done = run(labels, "--labels", labels, "--names", names, "--out", tmp_path / "heart")
    assert done.returncode == 0, done.stderr
    assert "over the labels" in (tmp_path / "heart" / "quality.html").read_text(encoding="utf-8")


def test_what_cannot_be_is_refused_in_one_sentence(inputs, tmp_path):
    ct, labels, names = inputs
    file = tmp_path / "file"
    file.write_text("", encoding="utf-8")
    empty = write(tmp_path / "empty.nii.gz", np.zeros((32, 40, 40), np.uint8))
    for arguments, said in (
        ((ct, "--labels", labels, "--out", file), "is a file"),
        ((ct, "--labels", labels, "--out", tmp_path), "is not a heart folder and is left alone"),
        ((ct, "--names", names, "--out", tmp_path / "heart"), "--names says"),
        ((ct, "--labels", labels, "--seeds", names, "--out", tmp_path / "heart"), "give one of the two"),
        ((ct, "--labels", empty, "--names", names, "--out", tmp_path / "heart"), ""),
    ):
        done = run(*arguments)
        assert done.returncode == 1, (arguments, done.stderr)
        assert done.stderr.startswith("Error: ")
        assert said in done.stderr
        assert len(done.stderr.strip().splitlines()) == 1
        assert not (tmp_path / "heart").exists()
