"""The generator: TypeScript and schemas that say what messages.py says, and a check that can fail."""

import json
import re
import shutil
from pathlib import Path
from typing import Any, Literal

import pytest

from cathxr.core import Rig
from cathxr.storage.rig_file import example_rig
from cathxr.wire import generate, messages, typescript
from cathxr.wire.convert import encode
from cathxr.wire.messages import Command, Message, SceneDescription
from cathxr.wire.scene import FRAMES, scene_description


@pytest.fixture
def checkout(tmp_path: Path, repo_root: Path) -> Path:
    for path in (generate.TYPESCRIPT_PATH, generate.DOCS_PATH):
        (tmp_path / path).parent.mkdir(parents=True)
        shutil.copy(repo_root / path, tmp_path / path)
    return tmp_path


def test_a_change_is_found_and_mended(checkout: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = ["--root", str(checkout)]
    assert generate.main([*run, "--check"]) == 0
    path = checkout / generate.TYPESCRIPT_PATH
    path.write_text(path.read_text(encoding="utf-8").replace("sigma_mm", "sigma"), encoding="utf-8")
    docs = checkout / generate.DOCS_PATH
    docs.write_text(docs.read_text(encoding="utf-8").replace('"sigma_mm"', '"sigma"'), encoding="utf-8")
    assert generate.main([*run, "--check"]) == 1
    assert "messages.ts is stale" in (said := capsys.readouterr().err)
    assert "wire.md is stale" in said
    assert generate.main(run) == 0
    assert generate.main([*run, "--check"]) == 0
    assert b"\r" not in path.read_bytes()


def test_what_people_wrote_in_the_docs_is_kept(checkout: Path) -> None:
    docs = checkout / generate.DOCS_PATH
    before = docs.read_text(encoding="utf-8")
    assert generate.with_schemas(before.replace("# The link", "# My words", 1)).startswith("# My words")
    docs.write_text(before.replace(generate.BEGIN, ""), encoding="utf-8")
    assert generate.main(["--root", str(checkout)]) == 2
    assert generate.main(["--root", str(checkout / "docs")]) == 2


def test_every_message_is_in_both(repo_root: Path) -> None:
    text, docs = typescript.typescript(), generate.schema_text()
    for model in typescript.all_models():
        assert f"export interface {model.__name__} {{" in text
    for union in (messages.ServerMessage, messages.ClientMessage):
        for model in typescript.models_of(union):
            assert f"#### `{model.model_fields['type'].default}`" in docs


def test_only_what_a_client_may_leave_out_is_optional() -> None:
    text = typescript.typescript()
    assert set(re.findall(r"(\w+)\?:", text)) == {"args", "id", "head", "world"}
    schemas = [json.loads(each) for each in re.findall(r"```json\n(.*?)```", generate.schema_text(), re.DOTALL)]
    required = {
        each["properties"]["type"]["const"]: each["required"] for each in schemas if "type" in each["properties"]
    }
    assert required["command"] == ["type", "name"]
    assert set(required["refusal"]) == {"type", "code", "sentence", "id"}


def test_an_unknown_type_is_an_error_not_a_guess() -> None:
    class Strange(Message):
        """Has a set."""

        values: set[int]
        kind: Literal["a */ b"] = "a */ b"

    aliases: dict[str, Any] = {}
    with pytest.raises(TypeError, match=r"set\[int\]"):
        typescript._interface(Strange, aliases, optional=False)


def test_defaults_are_written_out() -> None:
    assert json.loads(encode(Command(name="x"))) == {"type": "command", "name": "x", "args": {}, "id": None}


def test_the_scene_holds_the_rig() -> None:
    rig: Rig = example_rig()
    scene = SceneDescription.model_validate_json(scene_description(rig, "twin").model_dump_json())
    assert scene.roi_max_mm == tuple(rig.roi.max_mm)
    assert scene.frames == dict(FRAMES)
    for camera in scene.cameras:
        measured = rig.cameras[camera.name]
        assert camera.size_px == measured.size_px
        assert camera.distortion == tuple(measured.intrinsics.distortion)
        assert camera.camera_from_box.rotation_wxyz == tuple(measured.camera_from_box.rotation_wxyz)
