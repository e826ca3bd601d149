"""Recorded pictures of one camera: a folder of picture files in natural order, or a video. Never loads all of them."""

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from cathxr.core import DataError, PixelArray, RigCamera
from cathxr.storage.atomic import os_reason
from cathxr.storage.video import Video

SUFFIXES = frozenset({".png", ".jpg", ".jpeg", ".jpe", ".bmp", ".tif", ".tiff", ".webp", ".pgm", ".ppm", ".pnm"})
"""File names of pictures; anything else in a folder is passed over."""

_FLAGS = cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH | cv2.IMREAD_IGNORE_ORIENTATION


class Pictures(Protocol):
    """The pictures of one camera, one after the other.

    name: the path, for sentences. count: how many there are, None when only the end tells; about: a guess, None without
    one. notes: what was done to the pixels that a person should know, filled while reading.
    """

    name: str
    count: int | None
    about: int | None
    notes: list[str]

    def __iter__(self) -> Iterator[PixelArray]:
        """Yield each picture, uint8 (H, W) grey or (H, W, 3) BGR, from the first at each call.

        Raises:
            DataError: a picture or the file is damaged.
        """
        ...

    def first_size_px(self) -> tuple[int, int]:
        """Return width and height of the first picture.

        Raises:
            DataError: there is none, or it cannot be read.
        """
        ...


def open_pictures(path: str | os.PathLike[str], camera: RigCamera) -> Pictures:
    """Return the pictures at `path` after checking that the first one is there and has the camera's size.

    Raises:
        DataError: nothing there, not pictures, damaged, or of another size than the rig's camera.
    """
    place = Path(path)
    if not place.exists():
        raise DataError(f"{place}: no such file or folder; check the path of the {camera.name} pictures.")
    pictures: Pictures = FolderPictures(place) if place.is_dir() else Video(place)
    check_size(pictures.first_size_px(), camera, where=str(place))
    return pictures


def check_size(size_px: tuple[int, int], camera: RigCamera, *, where: str) -> None:
    """Return when a picture of width and height `size_px` is one of `camera`.

    Raises:
        DataError: it is not; `where` names the picture.
    """
    if size_px != camera.size_px:
        (width, height), (wide, high) = size_px, camera.size_px
        raise DataError(
            f"{where}: expected {wide}x{high} pixels, the size of the rig's {camera.name} camera, got {width}x{height}"
            "; use the rig that belongs to these pictures, and do not scale them."
        )


def read_picture(path: Path, *, notes: list[str] | None = None) -> PixelArray:
    """Return a picture file as uint8 BGR (H, W, 3); the EXIF orientation is ignored, 16 bits are scaled to 8.

    Raises:
        DataError: missing, empty, cut off, not a picture, or neither 8 nor 16 bits.
    """
    try:
        raw = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path}: cannot read the picture ({os_reason(error)}); check the path.") from error
    if not raw:
        raise DataError(f"{path}: expected a picture, got an empty file; replace or remove it.")
    if raw[:2] == b"\xff\xd8" and not _jpeg_ends(raw):
        raise DataError(f"{path}: the picture is cut off before its end; replace or remove it.")
    pixels = _decoded(raw)
    if pixels is None or pixels.size == 0:
        raise DataError(f"{path}: expected a picture, got a file that is damaged or none; replace or remove it.")
    if pixels.dtype == np.uint16:
        note = "16-bit pictures were scaled to 8 bits (divided by 257)"
        if notes is not None and note not in notes:
            notes.append(note)
        # 65535 / 257 = 255 exactly; adding half of 257 rounds.
        pixels = ((pixels.astype(np.uint32) + 128) // 257).astype(np.uint8)
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 3:
        raise DataError(
            f"{path}: expected 8 or 16 bits for each colour, got {pixels.dtype}; convert it, to PNG for example."
        )
    return np.asarray(pixels, dtype=np.uint8)


class FolderPictures:
    """The picture files of a folder in natural order (img2 before img10). Hidden files and other kinds do not count."""

    def __init__(self, folder: Path) -> None:
        """Look at the folder's names.

        Raises:
            DataError: the folder cannot be read or holds no picture.
        """
        try:
            names = [each for each in folder.iterdir() if each.suffix.lower() in SUFFIXES and each.name[0] != "."]
            self.files = sorted((each for each in names if each.is_file()), key=lambda each: natural_key(each.name))
        except OSError as error:
            raise DataError(f"{folder}: cannot read the folder ({os_reason(error)}); check its permissions.") from error
        if not self.files:
            kinds = ", ".join(sorted(each[1:] for each in SUFFIXES))
            raise DataError(f"{folder}: expected pictures ({kinds}), got a folder without any; check the path.")
        self.name = str(folder)
        self.count: int | None = len(self.files)
        self.about: int | None = len(self.files)
        self.notes: list[str] = []

    def __iter__(self) -> Iterator[PixelArray]:
        """Yield each picture as BGR."""
        shape = None
        for file in self.files:
            pixels = read_picture(file, notes=self.notes)
            if shape is not None and pixels.shape != shape:
                raise DataError(
                    f"{file}: expected {shape[1]}x{shape[0]} pixels like the pictures before it, "
                    f"got {pixels.shape[1]}x{pixels.shape[0]}; remove or replace it."
                )
            shape = pixels.shape
            yield pixels

    def first_size_px(self) -> tuple[int, int]:
        """Return width and height of the first picture."""
        pixels = read_picture(self.files[0])
        return int(pixels.shape[1]), int(pixels.shape[0])


def natural_key(name: str) -> tuple[list[tuple[int, int, str]], str]:
    """Return a sorting key by which numbers inside names count as numbers: img2 before img10."""
    parts = re.split(r"([0-9]+)", name.casefold())
    return [(0, int(each), "") if i % 2 else (1, 0, each) for i, each in enumerate(parts)], name


def _decoded(raw: bytes) -> NDArray[np.generic] | None:
    try:
        return cv2.imdecode(np.frombuffer(raw, dtype=np.uint8), _FLAGS)
    except cv2.error:
        return None


def _jpeg_ends(raw: bytes) -> bool:
    """Return whether a JPEG file holds its end: the decoder would fill a missing rest with grey, without a word."""
    at = 2
    while at + 4 <= len(raw) and raw[at] == 0xFF:
        marker = raw[at + 1]
        if marker == 0xFF:
            at += 1
            continue
        at += 2 + int.from_bytes(raw[at + 2 : at + 4], "big")
        if marker == 0xDA:  # start of scan: entropy-coded data follow, in which a bare FFD9 can only be the end
            return raw.find(b"\xff\xd9", at) >= 0
    return False
