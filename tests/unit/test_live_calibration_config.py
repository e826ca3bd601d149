"""Changing one table of a configuration, and nothing else in it."""

import tomllib
from pathlib import Path

import pytest

from cathxr.app.camera_choice import write_camera_choice
from cathxr.app.config import read_config
from cathxr.core import ConfigError
from cathxr.devices.camera_lock import LockedSettings
from cathxr.storage.toml_edit import with_table

TEXT = """\
# our box
schema = "cathxr-config/1"

[server]
port = 9000   # the old one is taken

[cameras]
driver = "opencv"

[cameras.top]          # above
device = 0             # first socket
# not too bright
exposure = 80
focus = 10

# seen from the side
[cameras.front]
device = "a # b"   # odd name

[tracking]
method = "model"
"""
TOP = LockedSettings(exposure=120.0, gain=2.5)
FRONT = LockedSettings(exposure=90.0)


def test_values_change_and_every_comment_stays() -> None:
    text = with_table(TEXT, ("cameras", "top"), {"device": "/dev/x", "exposure": 120, "gain": 2.5})
    assert text == TEXT.replace("device = 0             # first", 'device = "/dev/x"             # first').replace(
        "exposure = 80\nfocus = 10\n", "exposure = 120\ngain = 2.5\n"
    )


def test_a_comment_sign_within_a_text_is_no_comment() -> None:
    text = with_table(TEXT, ("cameras", "front"), {"device": 1})
    assert "device = 1   # odd name\n" in text


def test_a_table_that_is_not_there_is_appended() -> None:
    text = with_table("a = 1", ("cameras", "top"), {"device": 1})
    assert text == "a = 1\n\n[cameras.top]\ndevice = 1\n"


@pytest.mark.parametrize(
    "text",
    [
        "cameras.top.device = 0\n",
        "[cameras]\ntop = { device = 0 }\n",
        "[cameras.top]\ndevice = [\n 1,\n 2,\n]\n",
        '[cameras.top]\nnote = """\ndevice = 1\n"""\n',
        "[cameras.top]\n[cameras.top.more]\nx = 1\n",
        "cameras = 3\n",
        "not toml",
    ],
)
def test_what_cannot_be_changed_line_by_line_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match=r"change|table"):
        with_table(text, ("cameras", "top"), {"device": 1})


def test_a_choice_of_cameras_is_written_with_a_backup_and_is_a_configuration(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text(TEXT, encoding="utf-8")
    said = write_camera_choice(path, {"top": (2, TOP), "front": (0, FRONT)})
    assert "the earlier file is beside it" in said
    assert (tmp_path / "config.toml.bak").read_text(encoding="utf-8") == TEXT
    config = read_config(path)
    assert config.cameras.top == {"device": 2, "exposure": 120, "gain": 2.5}
    assert config.cameras.front == {"device": 0, "exposure": 90}
    assert config.server.port == 9000
    assert "# seen from the side\n[cameras.front]" in path.read_text(encoding="utf-8")


def test_a_new_configuration_is_made(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    said = write_camera_choice(path, {"top": ("/dev/a", TOP), "front": ("/dev/b", FRONT)})
    assert "beside" not in said
    assert read_config(path).cameras.front == {"device": "/dev/b", "exposure": 90}
    assert [each.name for each in tmp_path.iterdir()] == ["config.toml"]


def test_an_inline_configuration_loses_its_comments_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text(
        'schema = "cathxr-config/1"\n[cameras]\ntop = { device = 0, fourcc = "YUYV" } # x\n', encoding="utf-8"
    )
    said = write_camera_choice(path, {"top": (1, TOP), "front": (2, FRONT)})
    assert "comments could not be kept" in said
    assert tomllib.loads(path.read_text(encoding="utf-8"))["cameras"]["top"] == {
        "device": 1,
        "fourcc": "YUYV",
        "exposure": 120,
        "gain": 2.5,
    }


def test_a_file_that_is_no_configuration_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text("prot = 1\n", encoding="utf-8")
    with pytest.raises(ConfigError, match="'prot' is unknown"):
        write_camera_choice(path, {"top": (1, TOP), "front": (2, FRONT)})
    assert path.read_text(encoding="utf-8") == "prot = 1\n"
    assert len(list(tmp_path.iterdir())) == 1
