"""Video files: what FFmpeg reads comes through, lossless is exact, damage is a sentence, browsers play the overlay."""

import re

import av
import cv2
import numpy as np
import pytest

from cathxr.core import Catheter, DataError, Intrinsics, Pose, Rig, RigCamera, Roi, Status, Track
from cathxr.geometry import CameraModel
from cathxr.storage.overlay import OverlayWriter, caption, drawn
from cathxr.storage.video import LosslessVideo, Video

RANDOM = np.random.default_rng(1)


def blurred(seed, width=160, height=120):
    noise = np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)
    return cv2.GaussianBlur(noise, (9, 9), 2)


def write_video(path, *, count=40, codec="libx264", pixel_format="yuv420p", options=None, rotate=None):
    with av.open(str(path), "w", options=options or {}) as container:
        stream = container.add_stream(codec, rate=30)
        stream.width, stream.height, stream.pix_fmt = 160, 120, pixel_format
        if rotate:
            stream.metadata["rotate"] = str(rotate)
        for seed in range(count):
            frame = av.VideoFrame.from_ndarray(blurred(seed), format="bgr24").reformat(format=pixel_format)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


@pytest.mark.parametrize(
    ("name", "codec", "pixel_format", "tolerance"),
    [
        # Mean absolute error of lossy codecs on blurred noise, 8-bit levels: chroma is halved, blocks are quantised.
        ("v.mp4", "libx264", "yuv420p", 12.0),
        ("v.avi", "mjpeg", "yuvj420p", 12.0),
        ("v.mkv", "ffv1", "bgr0", 0.0),
        ("v.mov", "png", "rgb24", 0.0),
    ],
)
def test_pictures_come_through(tmp_path, name, codec, pixel_format, tolerance):
    write_video(tmp_path / name, codec=codec, pixel_format=pixel_format)
    video = Video(tmp_path / name)
    assert video.count is None
    assert video.about == 40
    assert video.first_size_px() == (160, 120)
    pictures = list(video)
    assert len(pictures) == 40
    assert all(each.shape == (120, 160, 3) and each.dtype == np.uint8 for each in pictures)
    for seed in (0, 39):
        assert np.abs(pictures[seed].astype(float) - blurred(seed)).mean() <= tolerance


def test_a_name_without_suffix_and_rotation_metadata_do_not_matter(tmp_path):
    write_video(tmp_path / "v.mp4", rotate=90)
    (tmp_path / "v.mp4").rename(tmp_path / "recording")
    assert Video(tmp_path / "recording").first_size_px() == (160, 120)


@pytest.mark.parametrize("shape", [(48, 64), (48, 64, 3), (45, 63, 3)])
def test_lossless_is_exact_and_readable_before_it_is_closed(tmp_path, shape):
    pictures = [RANDOM.integers(0, 256, shape, dtype=np.uint8) for _ in range(90)]
    path = tmp_path / "top.mkv"
    video = LosslessVideo(path, size_px=(shape[1], shape[0]), is_grey=len(shape) == 2, rate_hz=30.0)
    for index, each in enumerate(pictures):
        assert video.write(each) == index
    early = tmp_path / "early.mkv"
    early.write_bytes(path.read_bytes())
    unfinished = list(Video(early))
    # Clusters of half a second at 30 pictures a second: at most 15 pictures, and one in the muxer, are not yet there.
    assert len(unfinished) >= 90 - 16 - 1
    assert all(np.array_equal(a, b) for a, b in zip(unfinished, pictures, strict=False))
    video.close()
    assert all(np.array_equal(a, b) for a, b in zip(Video(path), pictures, strict=True))
    with pytest.raises(DataError, match="already"):
        LosslessVideo(path, size_px=(64, 48), is_grey=True, rate_hz=30.0)


def test_recording_into_a_missing_folder_is_a_sentence(tmp_path):
    with pytest.raises(DataError, match="cannot write the video"):
        LosslessVideo(tmp_path / "none" / "top.mkv", size_px=(64, 48), is_grey=True, rate_hz=30.0)


@pytest.mark.parametrize("name", ["v.mp4", "v.mkv", "v.avi", "fast.mp4"])
@pytest.mark.parametrize("kept", [0.0, 0.02, 0.6])
def test_a_video_cut_off_is_a_sentence(tmp_path, name, kept):
    codec, pixel_format = ("mjpeg", "yuvj420p") if name.endswith("avi") else ("libx264", "yuv420p")
    options = {"movflags": "+faststart"} if name == "fast.mp4" else None
    write_video(tmp_path / name, count=80, codec=codec, pixel_format=pixel_format, options=options)
    path = tmp_path / name
    raw = path.read_bytes()
    path.write_bytes(raw[: int(kept * len(raw))])
    with pytest.raises(DataError, match=re.escape(str(path))) as caught:
        list(Video(path))
    assert str(caught.value).endswith(".")


@pytest.mark.parametrize("content", [b"hello " * 500, b"\x00" * 5000])
def test_a_file_that_is_no_video_is_a_sentence(tmp_path, content):
    (tmp_path / "v.mp4").write_bytes(content)
    with pytest.raises(DataError, match=r"v\.mp4"):
        list(Video(tmp_path / "v.mp4"))


def test_damage_inside_a_video_is_a_sentence(tmp_path):
    video = LosslessVideo(tmp_path / "v.mkv", size_px=(160, 120), is_grey=False, rate_hz=30.0)
    for seed in range(40):
        video.write(blurred(seed))
    video.close()
    raw = bytearray((tmp_path / "v.mkv").read_bytes())
    # The demuxer finds its way again after a hole of two pictures, and after one near the end the file just ends.
    hole = len(raw) // 40 * 2
    for part in (0.5, 0.95):
        path = tmp_path / f"hole{part}.mkv"
        start = int(part * len(raw)) - hole
        path.write_bytes(raw[:start] + bytes(hole) + raw[start + hole :])
        with pytest.raises(DataError, match="damaged"):
            list(Video(path, is_steady=True))


def test_sound_only_is_a_sentence(tmp_path):
    with av.open(str(tmp_path / "a.wav"), "w") as container:
        stream = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), dtype=np.int16), format="s16", layout="mono")
        frame.rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    with pytest.raises(DataError, match="without pictures"):
        Video(tmp_path / "a.wav")


def small_rig():
    intrinsics = Intrinsics(np.array([300.0, 300.0]), np.array([160.0, 120.0]))
    top = RigCamera("top", (320, 240), 30.0, intrinsics, Pose(np.array([0.0, 1, 0, 0]), np.array([-60.0, 0, 330])))
    half = np.sqrt(0.5)
    front = RigCamera(
        "front", (322, 242), 30.0, intrinsics, Pose(np.array([half, half, 0, 0]), np.array([-60.0, 0, 330]))
    )
    roi = Roi(np.array([0.0, -60, -60]), np.array([120.0, 60, 60]))
    return Rig("small", roi, Catheter("c", 3.0), {"top": top, "front": front})


def straight(status=Status.TRACKED):
    shape = np.column_stack([np.linspace(80.0, 0.0, 20), np.zeros(20), np.zeros(20)])
    return Track(4, 0, status, "" if status is Status.TRACKED else "dark", shape, Pose.identity(), None, 0.1)


LOST = Track(5, 0, Status.LOST, "no catheter")


def test_the_curve_is_drawn_where_the_camera_sees_it():
    camera = CameraModel.of(small_rig().cameras["top"])
    track = straight()
    grey = np.full((240, 320), 128, dtype=np.uint8)
    view = drawn(grey, camera, track, size_px=(320, 240))
    assert track.shape_box is not None
    coloured = np.argwhere(view[:, :, 1].astype(int) - view[:, :, 2] > 60)[:, ::-1]
    pixels = camera.project(track.shape_box)
    # A one-pixel anti-aliased line is centred within half a pixel of where it was asked for.
    assert abs(np.median(coloured[:, 1]) - pixels[0, 1]) <= 0.5
    assert coloured[:, 0].min() >= pixels[:, 0].min() - 1
    assert np.array_equal(grey, np.full((240, 320), 128, dtype=np.uint8))
    assert np.array_equal(drawn(grey, camera, LOST, size_px=(320, 240)), np.dstack([grey] * 3))
    half = drawn(grey, camera, track, size_px=(160, 120))
    rows = np.argwhere(half[:, :, 1].astype(int) - half[:, :, 2] > 60)[:, 0]
    assert abs(np.median(rows) - ((pixels[0, 1] + 0.5) / 2 - 0.5)) <= 0.5


def test_the_caption_says_what_happened():
    assert caption(straight()) == "pair 4   tracked   tip 80.00 0.00 0.00 mm"
    assert caption(LOST) == "pair 5   lost (no catheter)"


def test_the_overlay_is_what_browsers_play(tmp_path):
    path = tmp_path / "overlay.mp4"
    tracks = [straight(), straight(Status.COASTING), LOST]
    with OverlayWriter(path, small_rig()) as writer:
        for each in tracks:
            writer.write(np.full((240, 320), 128, np.uint8), np.full((242, 322, 3), 128, np.uint8), each)
    assert [each.name for each in tmp_path.iterdir()] == ["overlay.mp4"]
    raw = path.read_bytes()
    assert 0 < raw.find(b"moov") < raw.find(b"mdat")
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert stream.width % 2 == stream.height % 2 == 0
        assert stream.width == 642
        assert stream.frames == 3


def test_an_overlay_of_large_cameras_is_at_most_1920_wide(tmp_path):
    rig = small_rig()
    large = {
        name: RigCamera(name, (2593, 1945), 30.0, each.intrinsics, each.camera_from_box)
        for name, each in rig.cameras.items()
    }
    with OverlayWriter(tmp_path / "o.mp4", Rig("large", rig.roi, rig.catheter, large)) as writer:
        writer.write(np.zeros((1945, 2593), np.uint8), np.zeros((1945, 2593), np.uint8), straight())
    with av.open(str(tmp_path / "o.mp4")) as container:
        assert 1900 <= container.streams.video[0].width <= 1920


def test_an_overlay_that_fails_leaves_nothing(tmp_path):
    def fail():
        with OverlayWriter(tmp_path / "o.mp4", small_rig()) as writer:
            writer.write(np.zeros((240, 320), np.uint8), np.zeros((242, 322), np.uint8), LOST)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail()
    with OverlayWriter(tmp_path / "o.mp4", small_rig()):
        pass
    with pytest.raises(DataError, match="cannot write"), OverlayWriter(tmp_path / "none" / "o.mp4", small_rig()):
        pass
    assert list(tmp_path.iterdir()) == []


def test_a_lost_pair_shows_no_ghost_of_the_curve_before(tmp_path):
    rig = small_rig()
    top, front = np.full((240, 320), 30, np.uint8), np.full((242, 322), 30, np.uint8)
    with OverlayWriter(tmp_path / "o.mp4", rig) as writer:
        for each in (*[straight()] * 5, *[LOST] * 3):
            writer.write(top, front, each)
    pictures = [each[32:].astype(int) for each in Video(tmp_path / "o.mp4")]
    green = [float((each[:, :, 1] - each[:, :, 2]).max()) for each in pictures]
    # A grey picture coded on its own shows a colour of a few levels of 255 at the most; the curve shows over a hundred.
    assert min(green[:5]) > 60
    assert max(green[5:]) <= 8
