"""The browser's ultrasound image against the reference in Python, pixel by pixel: the same scatterers and echoes."""

import base64
import importlib.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from cathxr.core import FloatArray
from cathxr.ultrasound import AcousticField, IceSettings, Resolved, fan_picture, simulate

from ..ultrasound_support.browser import IcePage, ice_page
from ..ultrasound_support.heart import heart_field, looking
from ..ultrasound_support.phantoms import ct_from_voxel, moved, phantom, share_within, voxel_centres

WIDE = IceSettings(dynamic_range_db=100.0, white_db=-10.0)
"""So wide a range that neither walls nor noise are cut off: grey levels are the whole envelope, in steps of 0.4 dB."""
_REGIONS = 8


@pytest.fixture(scope="module")
def page(
    repo_root: Path, tmp_path_factory: pytest.TempPathFactory, require_tool: Callable[[str], Path]
) -> Iterator[IcePage]:
    chromium = require_tool("chromium")
    require_tool("node")
    tool = _web_client_tool(repo_root)
    folder = tmp_path_factory.mktemp("harness")
    node = tool.install_packages(repo_root)
    tool.run_npm(repo_root, node, "exec", "--", "vite", "build", "tests/harness", "--outDir", str(folder))
    with ice_page(folder, chromium) as opened:
        yield opened


def _web_client_tool(root: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location("web_client_tool", root / "tools" / "web_client.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["web_client_tool"] = module
    spec.loader.exec_module(module)
    return module


def scene() -> AcousticField:
    """A slanted wall, a cyst, a bone and a region of strong scatter in tissue: everything that the model has."""
    x, y, z = voxel_centres()
    wall = share_within((x - 55.0) * 0.94 + z * 0.34)
    cyst = share_within(9.0 - np.hypot(np.hypot(x - 30.0, z + 14.0), y))
    bone = share_within(4.0 - np.abs(x - 28.0)) * share_within(5.0 - np.abs(z - 18.0))
    scatter = (1.0 - cyst) * (1.0 + 0.8 * wall)
    return phantom(0.02 * wall - 0.018 * cyst + 1.3 * bone, scatter, 0.5 - 0.3 * cyst + 7.0 * bone)


def assert_agree(grey: npt.NDArray[np.uint8], field: AcousticField, pose: FloatArray, settings: IceSettings) -> None:
    """The same envelope: correlated, of the same level everywhere, and nearly everywhere the same to a step or two.

    What differs: a graphics card interpolates with weights of 8 bits (2⁻⁹ of a code, 0.1 dB of a wall), stores the loss
    in half floats (2⁻¹¹: 0.03 dB at 60 dB) and the echoes twice (2⁻¹¹ of the real and imaginary part, which counts
    where these cancel), and works in 32 bits (2⁻²³ of a place of 200 mm: 2⁻¹³ of a lattice cell). A rasteriser in
    software may round interpolated codes to 8 bits: half a step of blood's attenuation, code 26, is 4 % of 20 dB there
    and back. So a region's mean is within 0.8 dB; dark places between speckles may be off by many dB, one in a hundred
    at most.
    """
    reference = simulate(field, pose, settings, seq=7)
    of, to = (each.astype(float) / 255.0 * settings.dynamic_range_db for each in (grey, reference.grey))
    assert to.std() > 5.0, "the picture is empty"
    envelope = [10.0 ** (level / 20.0).ravel() for level in (of, to)]
    assert np.corrcoef(*envelope)[0, 1] > 0.999
    off = of - to
    regions = off.reshape(_REGIONS, of.shape[0] // _REGIONS, _REGIONS, of.shape[1] // _REGIONS).mean(axis=(1, 3))
    assert np.abs(regions).max() < 0.8, np.round(regions, 2)
    assert np.percentile(np.abs(off), 90) < 1.3
    assert np.percentile(np.abs(off), 99) < 6.0


@pytest.mark.parametrize(
    "settings",
    [
        WIDE,
        replace(WIDE, slices=1, depth_mm=60.0, frequency_mhz=5.0),
        replace(
            WIDE,
            depth_mm=140.0,
            sector_rad=1.2,
            apex_mm=12.0,
            gain_db=4.0,
            tgc_db=(0.0, 3.0, -2.0, 1.0, 0.0, 6.0, 2.0, 1.0),
        ),
        IceSettings(),
    ],
    ids=["usual", "near", "deep", "as shown"],
)
def test_the_shader_agrees_on_a_phantom(page: IcePage, settings: IceSettings) -> None:
    field = scene()
    page.give(field)
    pose = looking(np.array([0.4, 0.7, -0.3]), np.array([60.0, 3.0, 2.0]), (0.05, 0.1, 1.0))
    assert_agree(page.grey(pose, settings, seq=7), field, pose, settings)


def test_the_shader_agrees_where_the_registration_scales_the_heart(page: IcePage) -> None:
    field = scene()
    page.give(field)
    pose = moved(2.0, 1.0, -0.5)
    pose[:3, :3] *= 0.8
    assert_agree(page.grey(pose, WIDE, seq=7), field, pose, WIDE)


def test_the_shader_agrees_on_a_heart(page: IcePage, shared_data: Path) -> None:
    pytest.importorskip(
        "vtkmodules.vtkCommonCore", reason="needs vtk, which comes with cathxr[heart]", exc_type=ImportError
    )
    field, centre = heart_field(shared_data / "heart_rodero01" / "derived_stl", 1.4)
    page.give(field)
    views = {"rv": (centre["ra_cavity"], centre["rv_cavity"]), "la": (centre["ra_cavity"], centre["la_cavity"])}
    for at, towards in views.values():
        pose = looking(at, towards)
        assert_agree(page.grey(pose, WIDE, seq=7), field, pose, WIDE)
    assert page.troubles == []


def test_both_work_out_the_same_numbers(page: IcePage) -> None:
    for settings in (IceSettings(), replace(WIDE, frequency_mhz=4.0, depth_mm=160.0, sector_rad=1.0, aperture_mm=10.0)):
        page.grey(moved(), settings)
        told: dict[str, Any] = page.call("resolved")
        expected = asdict(Resolved.of(settings))
        radius = {name: len(expected.pop(name)) for name in ("lateral", "axial")}
        for name, value in expected.items():
            camel = name.split("_")[0] + "".join(part.capitalize() for part in name.split("_")[1:])
            assert told[camel] == pytest.approx(value, rel=1e-12), name
        for name, count in radius.items():
            assert told[f"{name}Radius"] == count - 1
            assert told[name][:count] == pytest.approx(getattr(Resolved.of(settings), name), rel=1e-6)


def test_it_runs_at_its_own_rate_and_leaves_the_renderer_as_it_was(page: IcePage) -> None:
    page.give(scene())
    page.grey(moved(), IceSettings())
    before = page.call("made")
    assert page.call("update", 10.0) is True
    assert page.call("update", 10.011) is False  # the next frame at 90 Hz
    assert page.call("update", 10.022) is False
    assert page.call("update", 10.034) is True
    page.call("freeze", True)
    assert page.call("update", 11.0) is False
    page.call("freeze", False)
    assert page.call("made") == before + 2
    # Inside a headset's frame: its own target is set, WebXR is on, and three.js clears by itself.
    assert page.call("kept") == {"target": True, "xr": True, "autoClear": True, "calls": 0}
    assert page.call("draw") == 0
    assert page.troubles == []


def test_pictures_persist_as_asked(page: IcePage) -> None:
    """A picture of nothing after one of tissue: its share is left, to a step and a half of rounding."""
    page.give(phantom(0.0, 1.0, 0.2))
    dark = IceSettings(gain_db=-90.0)
    bright = page.grey(moved(), IceSettings()).astype(float)
    assert page.grey(moved(), dark).max() < 255 * 0.1  # the ring's very middle at most
    page.grey(moved(), IceSettings())
    left = page.grey(moved(), dark, persistence=0.4).astype(float)
    far = slice(100, None)
    assert np.abs(left[:, far] - 0.4 * bright[:, far]).max() <= 1.5


def _screen(page: IcePage) -> npt.NDArray[np.uint8]:
    assert page.call("draw") == 0
    data = base64.b64decode(page.call("png"))
    return np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR))


def test_the_panel_shows_the_fan_the_right_way_round(page: IcePage) -> None:
    """The reference's scan conversion, laid over the panel: distal is on the left, the transducer on top."""
    _, _, z = voxel_centres()
    field = phantom(0.0, np.where(z > 0.0, 1.0, 0.2), 0.2)
    page.give(field)
    settings = IceSettings(slices=1)
    page.grey(moved(), settings, seq=3)
    shown = _screen(page)[..., 0].astype(float)
    high, wide = shown.shape
    lines = slice(int(0.45 * high), int(0.6 * high))
    assert (
        shown[lines, int(0.3 * wide) : int(0.45 * wide)].mean()
        > 1.5 * shown[lines, int(0.55 * wide) : int(0.7 * wide)].mean()
    )
    # The panel's scale: the canvas shows the whole plate, and layout() leaves 58 pixels on each side.
    mm_per_px = 2.0 * (settings.apex_mm + settings.depth_mm) * np.sin(settings.sector_rad / 2.0) / (wide - 116.0)
    fan = fan_picture(simulate(field, moved(), settings, seq=3), mm_per_px=mm_per_px)
    top, left = 54, (wide - fan.grey.shape[1]) // 2
    seen = shown[top : top + fan.grey.shape[0], left : left + fan.grey.shape[1]]
    within = cv2.erode(fan.inside.astype(np.uint8), np.ones((9, 9), np.uint8)).astype(bool)
    blurred = [cv2.GaussianBlur(each.astype(np.float32), (0, 0), 1.5)[within] for each in (seen, fan.grey)]
    # Half a pixel of misplacement is allowed for: 0.97 of the correlation where speckles are 4 pixels wide.
    assert np.corrcoef(*blurred)[0, 1] > 0.97


def test_parts_are_coloured_only_where_they_are(page: IcePage) -> None:
    page.give(phantom(0.0, 1.0, 0.2))
    page.grey(moved(), IceSettings())
    plain = _screen(page)
    _, _, z = voxel_centres()
    page.give_labels(np.where(z > 0.0, 2, 0).astype(np.uint8), ct_from_voxel(), {2: "#ff2020"})
    page.call("pose", moved().ravel().tolist())
    coloured = _screen(page)
    page.call("colourless")
    assert np.array_equal(_screen(page), plain)
    high, wide = plain.shape[:2]
    left, right = (
        (slice(int(0.5 * high), int(0.6 * high)), slice(int(0.3 * wide), int(0.45 * wide))),
        (
            slice(int(0.5 * high), int(0.6 * high)),
            slice(int(0.55 * wide), int(0.7 * wide)),
        ),
    )
    assert np.array_equal(coloured[right], plain[right])
    blue, red = coloured[left][..., 0].mean(), coloured[left][..., 2].mean()
    assert red > 1.5 * blue
    assert page.troubles == []
