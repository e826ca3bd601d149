from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cathxr.app.cli import main
from cathxr.app.hardware_file import parameters_from_text, parameters_to_text
from cathxr.app.hardware_folder import check_place, folder_made_whole
from cathxr.core import ConfigError, DataError
from cathxr.hardware.bill import MadePart, bill_csv, bill_markdown, bill_rows
from cathxr.hardware.cutting import dxf_text, offset, paths, svg_text
from cathxr.hardware.layout import Layout
from cathxr.hardware.meshes import TriangleMesh, first_hits, wall_mm
from cathxr.hardware.meshfiles import printable, stl_bytes, threemf_bytes
from cathxr.hardware.panels import panels, rectangle
from cathxr.hardware.parameters import Parameters, RoiChoice

_CUBE_FACES = np.array(
    [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6],
     [3, 0, 4], [3, 4, 7]]
)  # fmt: skip


def _block(x: float, y: float, z: float) -> TriangleMesh:
    base = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=np.float64)
    return TriangleMesh(np.vstack([base, base + np.array([0.0, 0.0, 1.0])]) * (x, y, z), _CUBE_FACES)


def test_parameters_come_back_from_their_file() -> None:
    parameters = replace(Parameters(), name="ours", roi=RoiChoice(101.5))
    assert parameters_from_text(parameters_to_text(parameters), name="params.toml") == parameters


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('schema = "cathxr-rig/1"', "params.toml: schema: expected"),
        ('schema = "cathxr-hardware/1"\n[roi]\nsize = 3.0', "roi.size: expected one of the known keys"),
        ('schema = "cathxr-hardware/1"\n[roi]\nside_mm = -1.0', "roi.side_mm: expected a number greater than 0"),
        ('schema = "cathxr-hardware/1"\n[roi]\nside_mm = nan', "roi.side_mm: expected a number"),
        ('schema = "cathxr-hardware/1"\n[gear]\nencoder_teeth = 24.5', "gear.encoder_teeth: expected a whole number"),
        ('schema = "cathxr-hardware/1"\nname = "a\\nb"', "name: expected a name of one line"),
        ('schema = "cathxr-hardware/1"\n[catheter]\nname = "<9F>"', "catheter.name: expected a name of one line"),
        ('schema = "cathxr-hardware/1"\n[printer]\nbed_mm = [250.0, 0.0, 1.0]', "printer.bed_mm: expected positive"),
    ],
)
def test_wrong_parameters_are_told_by_their_key(text: str, told: str) -> None:
    with pytest.raises(ConfigError, match=told):
        parameters_from_text(text, name="params.toml")


def test_the_command_writes_what_it_can_read_and_shows_figures(tmp_path: Path) -> None:
    path = tmp_path / "params.toml"
    assert CliRunner().invoke(main, ["hardware", "params", "--out", str(path)]).exit_code == 0
    shown = CliRunner().invoke(main, ["hardware", "check", "--figures-only", "--params", str(path)])
    assert shown.exit_code == 0
    assert "0.0750 degrees a count" in " ".join(shown.output.split())


def test_an_impossible_rig_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    path, out = tmp_path / "params.toml", tmp_path / "rig"
    path.write_text('schema = "cathxr-hardware/1"\n[camera]\ndistance_mm = 260.0\nfocal_mm = 3.0\n', encoding="utf-8")
    done = CliRunner().invoke(main, ["hardware", "params", "--params", str(path), "--out", str(out)])
    assert done.exit_code == 1
    assert "end on the lit diffuser" in done.output
    assert not out.exists()


def _broken_off(out: Path) -> None:
    with folder_made_whole(out) as part:
        (part / "new").touch()
        raise RuntimeError("stop")


def test_a_folder_is_whole_or_as_it_was(tmp_path: Path) -> None:
    out = tmp_path / "rig"
    with folder_made_whole(out) as part:
        (part / "params.toml").write_text('schema = "cathxr-hardware/1"', encoding="utf-8")
    with pytest.raises(RuntimeError, match="stop"):
        _broken_off(out)
    assert [each.name for each in tmp_path.iterdir()] == ["rig"]
    assert [each.name for each in out.iterdir()] == ["params.toml"]
    check_place(out)
    with folder_made_whole(out) as part:
        (part / "other").touch()
    assert [each.name for each in out.iterdir()] == ["other"]
    with pytest.raises(DataError, match="holds other things"):
        check_place(out)


def test_the_kerf_goes_out_on_the_outside_and_in_on_the_inside() -> None:
    square = rectangle(10.0)
    assert np.abs(offset(square, 0.1)).max() == pytest.approx(5.1)
    assert np.abs(offset(square[::-1], -0.1)).max() == pytest.approx(4.9)


def test_sheets_keep_their_size_after_the_kerf_is_burnt(default: Layout) -> None:
    for panel in panels(default):
        polygons, circles = paths(panel, 0.2)
        assert polygons[-1].max() == pytest.approx(panel.outline.max() + 0.1)
        assert (circles[:, 2] == panel.circles[:, 2] - 0.2).all()
        dxf = dxf_text(panel, 0.2).split("\n")
        assert dxf.count("POLYLINE") == len(polygons)
        assert dxf.count("CIRCLE") == len(circles)
        assert svg_text(panel, 0.2).count("<polygon") == len(polygons)


def test_a_closed_block_is_closed_and_an_open_one_is_not() -> None:
    block = _block(3.0, 4.0, 5.0)
    assert block.open_edges() == 0
    assert block.volume_mm3() == pytest.approx(60.0)
    assert TriangleMesh(block.vertices, block.faces[:-1]).open_edges() > 0


def test_a_wall_is_as_thick_as_it_is() -> None:
    assert wall_mm(_block(30.0, 20.0, 0.8)) == pytest.approx(0.8, abs=1e-3)


def test_rays_meet_what_a_plain_loop_says_they_meet() -> None:
    rng = np.random.default_rng(0)
    triangles, origins, directions = rng.normal(size=(40, 3, 3)), rng.normal(size=(60, 3)) * 3, rng.normal(size=(60, 3))
    expected = np.full(60, np.inf)
    for i, (origin, direction) in enumerate(zip(origins, directions, strict=True)):
        for a, b, c in triangles:
            u, v, t = np.linalg.solve(np.column_stack([b - a, c - a, -direction]), origin - a)
            if u >= 0 and v >= 0 and u + v <= 1 and t > 0:
                expected[i] = min(expected[i], t)
    found, which = first_hits(origins, directions, triangles)
    assert np.allclose(found, expected)
    assert ((which >= 0) == np.isfinite(expected)).all()


def test_printed_files_hold_the_part_standing_on_the_bed() -> None:
    lying = printable(_block(3.0, 4.0, 5.0), (1.0, 0.0, 0.0))
    assert lying.vertices[:, 2].min() == pytest.approx(0.0)
    assert lying.vertices[:, 2].max() == pytest.approx(3.0)
    assert lying.volume_mm3() == pytest.approx(60.0)
    assert len(stl_bytes(lying, "block")) == 84 + 50 * 12
    assert threemf_bytes(lying, "a & b") == threemf_bytes(lying, "a & b")


def test_the_bill_lists_what_is_made_cut_and_bought(default: Layout) -> None:
    rows = bill_rows(default, [MadePart("beam", "Beam", "printed", 12, 121.0)])
    text = bill_markdown(default, rows)
    for wanted in ("| Beam | `beam` | 12 |", "global shutter", "Threaded rod M6", "4.7 kOhm", "neodymium", "MGN12"):
        assert wanted in text
    assert bill_csv(rows).count("\n") == len(rows) + 1
    weightless = {row[1] for row in rows if row[0] == "buy" and not row[5]}
    assert weightless == {"Glue"}
