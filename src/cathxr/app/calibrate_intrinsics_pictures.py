"""The pictures that `calibrate intrinsics` is given: files, folders, or a video of which some pictures are taken."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from cathxr.calibration.board import Board
from cathxr.calibration.board_finding import board_in, grey, other_board
from cathxr.calibration.board_views import BoardView, RejectedView, find_board, same_view
from cathxr.core import CalibrationError, ConfigError, DataError, PixelArray, RigCamera
from cathxr.storage.pictures import SUFFIXES, FolderPictures, read_picture
from cathxr.storage.video import Video

_VIDEO_VIEWS = 60
"""About so many pictures, evenly spread, are taken of a video."""
_MOVED_PX = 4.0
"""Pictures of a video in which the board has hardly moved since the one before are passed over."""
_SAMPLES = 6


@dataclass(eq=False)
class BoardPictures:
    """Pictures of one camera, read one after the other. samples: the first few in grey, for a closer look."""

    camera: RigCamera
    files: tuple[Path, ...]
    videos: tuple[Video, ...]
    samples: list[PixelArray] = field(default_factory=list)

    @property
    def count(self) -> int:
        """About how many pictures there are to look at."""
        return len(self.files) + _VIDEO_VIEWS * len(self.videos)

    def __iter__(self) -> Iterator[tuple[str, PixelArray]]:
        """Yield name and pixels of each."""
        names = [each.name for each in self.files]
        for path in self.files:
            yield (path.name if names.count(path.name) == 1 else str(path)), read_picture(path)
        for video in self.videos:
            every = max(1, (video.about or 600) // _VIDEO_VIEWS)
            for i, pixels in enumerate(video):
                if i % every == every // 2:
                    yield f"{Path(video.name).name}@{i}", pixels

    def check_some(self) -> None:
        """Return when pictures have the camera's size.

        Raises:
            CalibrationError: the first of them has another.
        """
        first = self.files[0] if self.files else None
        size = self.videos[0].first_size_px() if first is None else read_picture(first).shape[1::-1]
        where = self.videos[0].name if first is None else str(first)
        (width, height), (wide, high) = size, self.camera.size_px
        if (width, height) != (wide, high) and len(self.files) <= 1:
            raise CalibrationError(_size_sentence(where, (int(width), int(height)), self.camera))

    def hint(self, board: Board, views: Sequence[BoardView]) -> str | None:
        """Return, as a phrase, which other board the pictures seem to show, None where the board was found in some."""
        return None if views else other_board(board, self.samples)


def board_pictures(paths: Sequence[Path], camera: RigCamera) -> BoardPictures:
    """Return the pictures of files, folders and videos.

    Raises:
        ConfigError: none are given; DataError: one is not there or none; CalibrationError: of another size.
    """
    if not paths:
        raise ConfigError(
            "No pictures are given: name picture files, a folder or a video of the board, or take them now with --live."
        )
    files: list[Path] = []
    videos: list[Video] = []
    for path in paths:
        if not path.exists():
            raise DataError(f"{path}: no such file or folder; check the path of the {camera.name} pictures.")
        if path.is_dir():
            files += FolderPictures(path).files
        elif path.suffix.lower() in SUFFIXES:
            files.append(path)
        else:
            videos.append(Video(path))
    result = BoardPictures(camera, tuple(dict.fromkeys(files)), tuple(videos))
    result.check_some()
    return result


def found_views(
    board: Board, pictures: BoardPictures, *, window_px: int | None
) -> tuple[Board, list[BoardView | RejectedView]]:
    """Return the board in the pattern that the pictures show, and what was found in each picture.

    Raises:
        CalibrationError: all pictures have another size than the camera; DataError: one is damaged.
    """
    result: list[BoardView | RejectedView] = []
    settled = not board.has_two_patterns
    sizes = []
    with _progress() as bar:
        task = bar.add_task("looking for the board", total=pictures.count)
        for name, pixels in pictures:
            bar.advance(task)
            height, width = pixels.shape[:2]
            sizes.append((width, height))
            if (width, height) != pictures.camera.size_px:
                wide, high = pictures.camera.size_px
                reason = f"another picture size: {width}x{height} px, and the rig's camera has {wide}x{high}"
                result.append(RejectedView(name, reason))
                continue
            shades = grey(pixels)
            if len(pictures.samples) < _SAMPLES:
                pictures.samples.append(shades)
            if not settled:
                board, settled = _settled(board, shades)
            found = find_board(board, shades, name=name)
            if window_px is not None and isinstance(found, BoardView):
                found = _refined_by_opencv(board, shades, found, window_px)
            if "@" in name and isinstance(found, BoardView) and _repeats(result, found):
                continue
            result.append(found)
    if sizes and not any(size == pictures.camera.size_px for size in sizes):
        raise CalibrationError(_size_sentence("All pictures", sizes[0], pictures.camera))
    return board, result


def _refined_by_opencv(board: Board, shades: PixelArray, view: BoardView, window_px: int) -> BoardView | RejectedView:
    """Return the view with cornerSubPix's corners and its own sharpness, by which blurred ones are told."""
    refined = find_board(board, shades, name=view.name, corner_window_px=window_px)
    return replace(refined, sharpness=view.sharpness) if isinstance(refined, BoardView) else refined


def _settled(board: Board, shades: PixelArray) -> tuple[Board, bool]:
    """Return the board in the pattern a picture shows, and whether it shows one."""
    shown = board_in(board, [shades])
    if shown != board:
        return shown, True
    return board, isinstance(find_board(board, shades, name=""), BoardView)


def _repeats(found: Sequence[BoardView | RejectedView], view: BoardView) -> bool:
    last = next((each for each in reversed(found) if isinstance(each, BoardView)), None)
    return last is not None and same_view(last, view, limit_px=_MOVED_PX)


def _size_sentence(where: str, size_px: tuple[int, int], camera: RigCamera) -> str:
    (width, height), (wide, high) = size_px, camera.size_px
    return (
        f"{where}: expected {wide}x{high} pixels, the size of the rig's {camera.name} camera, got {width}x{height}; "
        "take the pictures in the size in which the camera is used, or correct size_px in the rig."
    )


def _progress() -> Progress:
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(),
        TimeRemainingColumn(compact=True), console=console, disable=not console.is_terminal, transient=True,
    )  # fmt: skip
