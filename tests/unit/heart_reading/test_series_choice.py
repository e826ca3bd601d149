"""Which series and which phase are read, and what is asked where that cannot be told."""

from pathlib import Path

import numpy as np
import pytest

from cathxr.core import DataError
from cathxr.heart.reading import find_series, read_volume, require_contrast
from cathxr.heart.reading.descriptions import described_percent
from cathxr.heart.volume import Volume

from ...heart_support.dicom_multiframe import write_enhanced
from ...heart_support.dicom_series import volume_of, write_series


def scan(value: int = 40, *, slices: int = 12, blood_hu: int | None = 400) -> Volume:
    """Return a body of 60 x 60 mm at `value` HU, with a bright pool of 36 x 36 x 48 mm (62 mL) unless None."""
    hu = np.full((slices, 30, 30), value)
    if blood_hu is not None:
        hu[:, 6:24, 6:24] = blood_hu
    return volume_of(hu, spacing=(2.0, 2.0, 48.0 / slices))


def flat(value: int) -> Volume:
    """Return a small volume of one value, to tell phases apart."""
    return volume_of(np.full((5, 12, 12), value), spacing=(2.0, 2.0, 2.0))


def phases_in_one_series(folder: Path, tags: dict[int, dict[str, object]]) -> None:
    """Write one series of several phases: a flat volume of each value with the tags given for it."""
    for value, of_phase in tags.items():
        write_series(folder / str(value), flat(value), shuffle=value, tags=of_phase, description=f"p{value}")


def test_the_phase_nearest_to_the_r_wave_is_end_diastole(tmp_path: Path) -> None:
    tags = {percent: {"NominalPercentageOfCardiacPhase": float(percent)} for percent in (10, 35, 70, 75, 90)}
    phases_in_one_series(tmp_path, tags)
    found = read_volume(tmp_path)
    assert found.hu[0, 0, 0] == 90
    assert found.technical.phase == "90 %, taken as end-diastole of 5 phases (10 %, 35 %, 70 %, 75 %, 90 %)"
    assert read_volume(tmp_path, phase="75 %").hu[0, 0, 0] == 75
    assert read_volume(tmp_path, phase=35).technical.phase == "35 %, as asked"


def test_zero_per_cent_is_the_r_wave_too(tmp_path: Path) -> None:
    phases_in_one_series(tmp_path, {p: {"NominalPercentageOfCardiacPhase": float(p)} for p in (0, 50, 80)})
    assert read_volume(tmp_path).hu[0, 0, 0] == 0


def test_systole_alone_asks(tmp_path: Path) -> None:
    phases_in_one_series(tmp_path, {p: {"NominalPercentageOfCardiacPhase": float(p)} for p in (20, 30, 40)})
    with pytest.raises(DataError, match=r"does not tell which one is end-diastole.*--phase.*20 %, 30 %, 40 %"):
        read_volume(tmp_path)
    with pytest.raises(DataError, match=r"The phase 75 is not in the series.*20 %, 30 %, 40 %"):
        read_volume(tmp_path, phase="75")
    assert find_series(tmp_path)[0].chosen == ""


def test_trigger_times_with_the_interval_are_per_cent(tmp_path: Path) -> None:
    tags = {ms // 10: {"TriggerTime": str(ms), "NominalInterval": "1000"} for ms in (50, 350, 750)}
    phases_in_one_series(tmp_path, tags)
    found = read_volume(tmp_path)
    assert found.technical.phase.startswith("5 %, taken as end-diastole")
    assert found.hu[0, 0, 0] == 5


def test_trigger_times_that_differ_a_little_from_slice_to_slice_are_one_phase(tmp_path: Path) -> None:
    for value, start in ((3, 300.0), (7, 700.0)):
        jitter = {k: {"TriggerTime": f"{start + 3.0 * k:.1f}"} for k in range(5)}
        write_series(tmp_path / str(value), flat(value), shuffle=value, tags_of=jitter, description=str(value))
    with pytest.raises(DataError, match=r"one of: 306 ms, 706 ms"):
        read_volume(tmp_path)
    assert set(np.unique(read_volume(tmp_path, phase="706 ms").hu)) == {7}


@pytest.mark.parametrize("keyword", ["AcquisitionNumber", "TemporalPositionIdentifier"])
def test_numbers_tell_phases_apart_but_not_which_is_which(tmp_path: Path, keyword: str) -> None:
    phases_in_one_series(tmp_path, {value: {keyword: 40 + value} for value in (1, 2)})
    with pytest.raises(DataError, match=r"2 phases and does not tell.*(acquisition|time) 1, (acquisition|time) 2"):
        read_volume(tmp_path)
    assert read_volume(tmp_path, phase=2).hu[0, 0, 0] == 2


def test_instance_numbers_are_the_last_resort(tmp_path: Path) -> None:
    for value in (1, 2):
        tags = {k: {"InstanceNumber": 10 * k + value} for k in range(5)}
        write_series(tmp_path / str(value), flat(value), tags_of=tags, description=str(value))
    with pytest.raises(DataError, match=r"--phase one of: time 1, time 2"):
        read_volume(tmp_path)
    assert set(np.unique(read_volume(tmp_path, phase="time 2").hu)) == {2}


def test_phases_in_series_of_their_own_are_told_by_their_descriptions(tmp_path: Path) -> None:
    for percent in (35, 75):
        volume = scan(percent)
        write_series(tmp_path / str(percent), volume, series=str(percent), description=f"CorCTA 0.75 Bv40 {percent} %")
    found = read_volume(tmp_path)
    assert found.hu[0, 0, 0] == 75
    assert found.technical.phase == "75 %, taken as end-diastole of 2 phases (35 %, 75 %)"
    assert read_volume(tmp_path, phase="35").hu[0, 0, 0] == 35


@pytest.mark.parametrize(
    ("text", "percent"),
    [("CTA 75%", 75.0), ("0.6 mm  72.5 %", 72.5), ("phase 40", 40.0), ("B26f 0.75", None), ("30% - 80%", None),
     ("120%", None)],
)  # fmt: skip
def test_per_cents_in_texts(text: str, percent: float | None) -> None:
    assert described_percent(text) == percent


def test_the_contrast_series_is_taken_among_others(tmp_path: Path) -> None:
    write_series(tmp_path / "native", scan(blood_hu=None), series="a")
    write_series(tmp_path / "cta", scan(), series="b")
    write_series(tmp_path / "scout", scan(slices=1), series="c", image_type=("ORIGINAL", "PRIMARY", "LOCALIZER"))
    tags = {"SOPClassUID": "1.2.840.10008.5.1.4.1.1.7"}
    write_series(tmp_path / "screen", scan(slices=2), series="d", tags=tags)
    (tmp_path / "README.txt").write_text("not DICOM", encoding="utf-8")
    found = read_volume(tmp_path)
    assert found.hu[6, 15, 15] == 400
    assert found.technical.contrast is True
    summaries = find_series(tmp_path)
    assert [each.problem for each in summaries] == ["", "", "a localiser", "a screen picture"]
    assert [each.contrast and each.contrast.is_bright for each in summaries] == [False, True, None, None]


def test_the_finer_of_two_series_is_taken(tmp_path: Path) -> None:
    write_series(tmp_path / "coarse", scan(slices=12), series="a")
    write_series(tmp_path / "fine", scan(slices=24), series="b")
    assert read_volume(tmp_path).grid.shape[0] == 24


def test_series_that_nothing_tells_apart_are_asked_for(tmp_path: Path) -> None:
    write_series(tmp_path / "smooth", scan(40), series="a", tags={"ConvolutionKernel": "Bv36d"})
    write_series(tmp_path / "sharp", scan(41), series="b", tags={"ConvolutionKernel": "Bv59d"})
    with pytest.raises(
        DataError, match=r"1 \(12 slices of 4\.00 mm, Bv36d\); 2 \(.*Bv59d\)\. Choose one with --series"
    ):
        read_volume(tmp_path)
    assert read_volume(tmp_path, series=2).hu[0, 0, 0] == 41
    with pytest.raises(DataError, match="no series 5; its series are numbered 1 to 2"):
        read_volume(tmp_path, series=5)


def test_orientations_of_one_series_are_series_of_their_own(tmp_path: Path) -> None:
    turned = volume_of(np.full((6, 12, 12), 7), rotation=np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]]))
    write_series(tmp_path / "axial", flat(5))
    write_series(tmp_path / "coronal", turned, description="cor")
    assert sorted(each.orientation for each in find_series(tmp_path)) == ["axial", "coronal"]


def test_blank_identifiers_do_not_mix_series_of_different_size(tmp_path: Path) -> None:
    blank = {"SeriesInstanceUID": "", "StudyInstanceUID": "", "SOPInstanceUID": "", "SOPClassUID": ""}
    write_series(tmp_path / "one", scan(), tags=blank)
    write_series(tmp_path / "two", flat(3), tags=blank)
    assert len(find_series(tmp_path)) == 2


def test_no_contrast_is_one_sentence(tmp_path: Path) -> None:
    write_series(tmp_path, scan(blood_hu=None))
    volume = read_volume(tmp_path)
    assert volume.technical.contrast is False
    with pytest.raises(DataError, match=r"shows no contrast in the blood.*choose the contrast series.*--labels"):
        require_contrast(volume)
    write_series(tmp_path / "x", scan())
    require_contrast(read_volume(tmp_path / "x"))


def test_bone_is_no_blood_pool(tmp_path: Path) -> None:
    # A native chest: the cortex of bones is bright and thin, a vertebra's inside 25 mL of 200 HU.
    hu = np.full((20, 60, 60), 40)
    hu[:, 10:50, 10:12] = 800
    hu[5:15, 30:44, 30:48] = 200
    write_series(tmp_path, volume_of(hu, spacing=(2.0, 2.0, 2.5)))
    assert read_volume(tmp_path).technical.contrast is False


def test_the_real_scan_has_contrast(shared_data: Path) -> None:
    found = find_series(shared_data / "cta_thorax" / "thorax_cta_1.5mm.nii.gz")[0]
    assert found.contrast is not None
    assert found.contrast.is_bright
    # The data's description gives 466 HU as the median of the whole heart mask, walls included.
    assert found.contrast.pool_hu == pytest.approx(470.0, abs=40.0)


def test_an_enhanced_file_lists_its_phases(tmp_path: Path) -> None:
    write_enhanced(tmp_path / "ct.dcm", {percent: flat(int(percent)) for percent in (0.0, 30.0, 70.0)})
    found = find_series(tmp_path / "ct.dcm")
    assert [each.phases for each in found] == [("0 %", "30 %", "70 %")]
    assert found[0].chosen == "0 %"
