"""config.toml: what docs/formats.md shows is what is read, and what is left out has its default."""

import re
from pathlib import Path

import pytest

from cathxr.app.config import Config, read_config
from cathxr.app.live_options import chosen_config
from cathxr.core import ConfigError


@pytest.fixture
def documented(repo_root: Path, tmp_path: Path) -> Path:
    text = (repo_root / "docs" / "formats.md").read_text(encoding="utf-8").split("## config.toml")[1]
    found = re.search(r"```toml\n(.*?)```", text, re.DOTALL)
    assert found is not None
    path = tmp_path / "config.toml"
    path.write_text(found.group(1), encoding="utf-8")
    return path


def test_the_documented_example_is_read_and_names_every_key(documented: Path) -> None:
    config = read_config(documented)
    assert config.cameras.top["device"] == 0
    text = documented.read_text(encoding="utf-8")
    for section, model in Config.model_fields.items():
        if section in ("schema_", "rig", "heart"):
            continue
        for key in type(getattr(config, section)).model_fields:
            assert re.search(rf"(^|\n|\.){key}( =|\])", text), f"{section}.{key} is not documented ({model})"


def test_relative_paths_count_from_the_file(documented: Path) -> None:
    config = read_config(documented)
    assert config.rig == str(documented.parent / "rig.toml")
    assert config.recording.folder == str(documented.parent / "recordings")
    assert config.tracking.background_top == str(documented.parent / "empty_top.png")


def test_an_empty_file_is_the_defaults(tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text("", encoding="utf-8")
    read = read_config(path)
    assert read.server == Config().server
    assert read.tracking == Config().tracking
    assert read.rig is None


def test_the_command_line_wins(documented: Path) -> None:
    config = chosen_config(documented, rig=Path("mine.toml"), method="paper", points=None, scene="fast", seed=None)
    assert (config.rig, config.tracking.method, config.tracking.points) == ("mine.toml", "paper", 50)
    assert (config.twin.scene, config.twin.seed) == ("fast", 0)


@pytest.mark.parametrize(
    "text", ['schema = "cathxr-config/2"', "[tracking]\npoints = 1", '[replay]\nspeed = "fast"', "[cameras]\ntop = 3"]
)
def test_what_is_wrong_names_the_key(text: str, tmp_path: Path) -> None:
    path = tmp_path / "config.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as caught:
        read_config(path)
    key = re.findall(r"(\w+) =", text)[-1]
    assert key in str(caught.value)
    assert "\n" not in str(caught.value)
