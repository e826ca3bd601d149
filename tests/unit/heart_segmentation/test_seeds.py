"""Seeds: their file, and what is wrong with one said in a sentence."""

from pathlib import Path

import pytest

from cathxr.core import ConfigError
from cathxr.heart.seeds import Seed, read_seeds, write_seeds


def test_seeds_come_back_from_their_file(tmp_path: Path) -> None:
    seeds = (
        Seed("left_atrium", (1.25, -20.5, 600.01)),
        Seed("none", (0.0, 0.0, 0.0), 4.5),
    )
    write_seeds(tmp_path / "seeds.csv", seeds)
    assert read_seeds(tmp_path / "seeds.csv") == seeds


def test_the_radius_may_be_left_out(tmp_path: Path) -> None:
    (tmp_path / "seeds.csv").write_text("structure,x_mm,y_mm,z_mm\naorta, 1, 2, 3\n", encoding="utf-8-sig")
    assert read_seeds(tmp_path / "seeds.csv") == (Seed("aorta", (1.0, 2.0, 3.0)),)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("structure,x,y,z\naorta,1,2,3\n", "first line"),
        ("structure,x_mm,y_mm,z_mm\nliver,1,2,3\n", "line 2.*liver"),
        ("structure,x_mm,y_mm,z_mm\naorta,1,two,3\n", "line 2"),
        ("structure,x_mm,y_mm,z_mm\naorta,1,nan,3\n", "line 2.*finite"),
        ("structure,x_mm,y_mm,z_mm\naorta,1,2\n", "line 2"),
        ("structure,x_mm,y_mm,z_mm,radius_mm\naorta,1,2,3,-1\n", "line 2.*radius"),
        ("structure,x_mm,y_mm,z_mm\nmyocardium,1,2,3\n", "line 2.*myocardium"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "seeds.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=says):
        read_seeds(path)


def test_a_missing_file_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot be read"):
        read_seeds(tmp_path / "none.csv")
