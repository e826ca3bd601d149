"""Folders of pictures and their small tables: natural order, every kind, one sentence for what is damaged."""

import re
import struct

import cv2
import numpy as np
import pytest

from cathxr.core import DataError
from cathxr.storage.pictures import FolderPictures, natural_key, open_pictures, read_picture
from cathxr.storage.rig_file import example_rig
from cathxr.storage.tables import read_roll, read_times

CAMERA = example_rig().cameras["top"]


def gradient(width=64, height=48, dtype=np.uint8):
    rows = np.linspace(0, np.iinfo(dtype).max, height)[:, None, None]
    return np.broadcast_to(rows, (height, width, 3)).astype(dtype)


def test_natural_order():
    names = ["img10.png", "img2.png", "Img1.png", "img02.png", "a.png", "10.png", "9.png"]
    assert sorted(names, key=natural_key) == [
        "9.png", "10.png", "a.png", "Img1.png", "img02.png", "img2.png", "img10.png",
    ]  # fmt: skip


def test_a_folder_gives_its_pictures_in_order_and_nothing_else(tmp_path):
    for name, level in (("p10.png", 10), ("p9.bmp", 9), ("p2.jpg", 2), ("p1.PGM", 1), ("p3.tiff", 3), ("p4.webp", 4)):
        shape = (48, 64) if name.endswith("PGM") else (48, 64, 3)
        assert cv2.imwrite(str(tmp_path / name.lower()), np.full(shape, level * 20, np.uint8))
    (tmp_path / "p1.pgm").rename(tmp_path / "p1.PGM")
    (tmp_path / "notes.txt").write_text("x")
    (tmp_path / ".hidden.png").write_bytes(b"x")
    (tmp_path / "sub.png").mkdir()
    pictures = FolderPictures(tmp_path)
    assert pictures.count == 6
    for _ in range(2):
        levels = [float(each.mean()) / 20 for each in pictures]
        assert np.allclose(levels, [1, 2, 3, 4, 9, 10], atol=0.1)  # JPEG and WebP round by a level or two of 255
    assert all(each.shape == (48, 64, 3) for each in pictures)


def test_exif_orientation_is_ignored(tmp_path):
    path = tmp_path / "turned.jpg"
    cv2.imwrite(str(path), gradient())
    plain = read_picture(path)
    tiff = b"II*\x00\x08\x00\x00\x00" + struct.pack("<HHHIHHI", 1, 0x0112, 3, 1, 6, 0, 0)
    exif = b"Exif\x00\x00" + tiff
    raw = path.read_bytes()
    path.write_bytes(raw[:2] + b"\xff\xe1" + struct.pack(">H", len(exif) + 2) + exif + raw[2:])
    assert cv2.imread(str(path)).shape == (64, 48, 3)  # the library would turn it
    assert np.array_equal(read_picture(path), plain)


def test_sixteen_bits_are_scaled_and_said(tmp_path):
    deep = gradient(dtype=np.uint16)
    cv2.imwrite(str(tmp_path / "deep.png"), deep)
    pictures = FolderPictures(tmp_path)
    (shallow,) = list(pictures)
    assert shallow.dtype == np.uint8
    assert np.abs(shallow - deep / 257.0).max() <= 0.5
    assert "16-bit" in pictures.notes[0]


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
@pytest.mark.parametrize(
    "damage", [lambda raw: b"", lambda raw: raw[: len(raw) // 2], lambda raw: b"hello", lambda raw: raw[:20]]
)
def test_a_damaged_picture_is_a_sentence_naming_it(tmp_path, suffix, damage):
    for index in range(3):
        noise = np.random.default_rng(index).integers(0, 256, (48, 64, 3), dtype=np.uint8)
        cv2.imwrite(str(tmp_path / f"p{index}{suffix}"), noise)
    path = tmp_path / f"p1{suffix}"
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(DataError, match=re.escape(str(path))) as caught:
        list(FolderPictures(tmp_path))
    assert str(caught.value).endswith(".")


def test_another_size_in_the_middle_is_a_sentence(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), gradient())
    cv2.imwrite(str(tmp_path / "b.png"), gradient(width=70))
    with pytest.raises(DataError, match=r"b\.png: expected 64x48.*got 70x48"):
        list(FolderPictures(tmp_path))


def test_a_size_that_is_not_the_rigs_is_a_sentence(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), gradient())
    with pytest.raises(DataError, match=r"1280x720.*top camera.*64x48"):
        open_pictures(tmp_path, CAMERA)


def test_nothing_there_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match="no such file or folder"):
        open_pictures(tmp_path / "none", CAMERA)
    with pytest.raises(DataError, match="folder without any"):
        open_pictures(tmp_path, CAMERA)


def table(tmp_path, text):
    path = tmp_path / "table.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def test_times_are_exact_nanoseconds(tmp_path):
    text = "\ufeffseq,t_top_s,t_front_s\r\n0,1746698400.123456789,1746698400.123456790\r\n\r\n"
    text += "1,1746698400.2,1746698401\r\n"
    times = read_times(table(tmp_path, text))
    assert times.top_ns.tolist() == [1746698400123456789, 1746698400200000000]
    assert times.front_ns.tolist() == [1746698400123456790, 1746698401000000000]


def test_roll_counts(tmp_path):
    readings = read_roll(table(tmp_path, "t_s,count\n0,1\n0.5,-7\n0.5,3\n"))
    assert readings.t_ns.tolist() == [0, 500_000_000, 500_000_000]
    assert readings.count.tolist() == [1.0, -7.0, 3.0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "an empty file"),
        ("seq,t_top,t_front\n0,0,0\n", "expected the first line seq,t_top_s,t_front_s"),
        ("seq;t_top_s;t_front_s\n0;0;0\n", "expected the first line"),
        ("seq,t_top_s,t_front_s\n", "expected rows"),
        ("seq,t_top_s,t_front_s\n0,0\n", "line 2: expected 3 values"),
        ("seq,t_top_s,t_front_s\n0,0,0,0\n", "line 2: expected 3 values"),
        ("seq,t_top_s,t_front_s\n0,zero,0\n", "line 2: expected a number for t_top_s, got 'zero'"),
        ("seq,t_top_s,t_front_s\n0,nan,0\n", "expected a number for t_top_s"),
        ("seq,t_top_s,t_front_s\n0,0,1e30\n", "expected a number for t_front_s"),
        ("seq,t_top_s,t_front_s\n0,0,\n", "expected a number for t_front_s"),
        ("seq,t_top_s,t_front_s\n1,0,0\n", "expected seq 0, got 1"),
        ("seq,t_top_s,t_front_s\n0,0,0\n0,1,1\n", "line 3: expected seq 1, got 0"),
        ("seq,t_top_s,t_front_s\n0,1,1\n1,1,2\n", "line 3: expected t_top_s later"),
        ("seq,t_top_s,t_front_s\n0,1,2\n1,2,1\n", "line 3: expected t_front_s later"),
        (b"\xff\xfe\x00", "save it as CSV"),
    ],
)
def test_a_wrong_table_of_times_is_a_sentence(tmp_path, text, says):
    path = table(tmp_path, text)
    with pytest.raises(DataError, match=re.escape(says)) as caught:
        read_times(path)
    assert str(path) in str(caught.value)


def test_roll_going_back_in_time_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match="line 3: expected t_s later"):
        read_roll(table(tmp_path, "t_s,count\n1,0\n0.5,0\n"))


def test_a_missing_table_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match="No such file"):
        read_roll(tmp_path / "none.csv")
