"""The heart folder: whole or not at all, the same bytes each time, and a quality page that tells what was measured."""

import re
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk

from cathxr.core import DataError
from cathxr.heart import HeartSource, read_heart
from cathxr.heart.build import build_heart
from cathxr.heart.build_folder import check_place, replacing
from cathxr.heart.glb import read_glb, surface
from cathxr.heart.surface import Surface, enclosed_volume_ml
from cathxr.heart.volume import LabelVolume, Technical, Volume

from .shapes import two_halves

SOURCE = HeartSource("phantom", "nobody", "https://example.org", "CC0", "", "")
REGISTRATION = """schema = "cathxr-registration/1"
kind = "{kind}"
method = "test"
[ct_from_box]
rotation_wxyz = [1.0, 0.0, 0.0, 0.0]
translation_mm = [0.0, 0.0, 0.0]
"""


def build(out: Path, labels: LabelVolume | None = None, **options) -> object:
    labels = two_halves() if labels is None else labels
    hu = np.where(labels.labels > 0, 400, 40).astype(np.int16)
    volume = Volume(hu, labels.grid, Technical("CT", phase="75 %"))
    return build_heart(out, volume=volume, labels=labels, source=SOURCE, name="Two halves", budget=3000, **options)


def content(folder: Path) -> dict[str, bytes]:
    return {each.name: each.read_bytes() for each in sorted(folder.iterdir())}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    out = tmp_path_factory.mktemp("hearts") / "heart"
    build(out, findings=["The atrium's roof <is> doubtful."])
    return out


def test_the_folder_reads_back_with_its_volumes(folder):
    heart = read_heart(folder)
    labels = two_halves()
    assert set(heart.structures) == {"left_ventricle", "left_atrium"}
    document, binary = read_glb(heart.glb)
    for key, structure in heart.structures.items():
        assert structure.volume_ml == pytest.approx(labels.volume_ml(key), abs=0.01)
        shown = Surface(*surface(document, binary, structure.node, with_caps=True))
        assert enclosed_volume_ml(shown) == pytest.approx(structure.volume_ml, rel=0.01)
    assert "mitral_valve" in heart.openings
    assert heart.acoustic is not None
    assert heart.technical is not None


def test_labels_have_the_catalogues_values_and_lie_where_they_lay(folder):
    labels = two_halves()
    image = sitk.ReadImage(str(folder / "labels.nii.gz"))
    # The catalogue: left ventricle 1, left atrium 3; the phantom has 1 and 2.
    expected = np.array([0, 1, 3], np.uint8)[labels.labels]
    assert np.array_equal(sitk.GetArrayFromImage(image), expected)
    # NIfTI holds the affine as float32.
    there = image.TransformContinuousIndexToPhysicalPoint([3.0, 7.0, 11.0])
    assert np.allclose(there, labels.grid.to_ct([3.0, 7.0, 11.0]), atol=1e-3)


def test_the_quality_page_needs_nothing_and_tells_the_figures(folder):
    text = (folder / "quality.html").read_text(encoding="utf-8")
    assert "<script" not in text
    assert not re.search(r'(src|href)="(?!data:)', text)
    assert text.count("data:image/png;base64,") == 4
    assert "The atrium&#x27;s roof &lt;is&gt; doubtful." in text
    assert "75 %" in text
    assert "Left ventricle" in text
    assert "✕" not in text
    for name in ("surfaces", "axial", "coronal", "sagittal"):
        assert (folder / f"quality_{name}.png").read_bytes().startswith(b"\x89PNG")


def test_the_same_labels_give_the_same_bytes(folder, tmp_path):
    build(tmp_path / "again", findings=["The atrium's roof <is> doubtful."])
    assert content(tmp_path / "again") == content(folder)


@pytest.mark.parametrize("error", [KeyboardInterrupt, DataError])
def test_an_interruption_leaves_what_was_there(tmp_path, error):
    out = tmp_path / "heart"
    build(out)
    before = content(out)

    def stop(what: str, share: float | None) -> None:
        if share is not None and share > 0.7:
            raise error("stop")

    with pytest.raises(error):
        build(out, progress=stop)
    assert content(out) == before
    assert [each.name for each in tmp_path.iterdir()] == ["heart"]
    with pytest.raises(error):
        build(tmp_path / "new", progress=stop)
    assert [each.name for each in tmp_path.iterdir()] == ["heart"]


def test_a_persons_files_and_a_measured_registration_survive_a_new_build(tmp_path):
    out = tmp_path / "heart"
    build(out)
    (out / "notes.txt").write_text("mine", encoding="utf-8")
    (out / "registration.toml").write_text(REGISTRATION.format(kind="rigid"), encoding="utf-8")
    build(out, registration=REGISTRATION.format(kind="placement"))
    assert (out / "notes.txt").read_text(encoding="utf-8") == "mine"
    assert 'kind = "rigid"' in (out / "registration.toml").read_text(encoding="utf-8")
    # On another grid it is another `ct`.
    build(out, two_halves(size=50), registration=REGISTRATION.format(kind="placement"))
    assert 'kind = "placement"' in (out / "registration.toml").read_text(encoding="utf-8")


def test_other_folders_and_files_are_left_alone(tmp_path):
    file = tmp_path / "file"
    file.write_text("", encoding="utf-8")
    with pytest.raises(DataError, match="is a file"):
        check_place(file)
    other = tmp_path / "other"
    other.mkdir()
    check_place(other)
    (other / "thesis.tex").write_text("", encoding="utf-8")
    with pytest.raises(DataError, match="not a heart folder and is left alone"), replacing(other, keeps=lambda _: ()):
        pass
    with pytest.raises(DataError, match="cannot be written"), replacing(file / "heart", keeps=lambda _: ()):
        pass
    assert (other / "thesis.tex").exists()


def test_a_structure_of_one_voxel_is_left_out_and_said(tmp_path):
    labels = two_halves()
    voxels = labels.labels.copy()
    voxels[1, 1, 1] = 7
    build(tmp_path / "heart", LabelVolume(voxels, labels.grid, {**labels.names, 7: "aorta"}))
    assert "aorta" not in read_heart(tmp_path / "heart").structures
    assert "Aorta: only 1 voxels" in (tmp_path / "heart" / "quality.html").read_text(encoding="utf-8")
