"""`cathxr hardware export`: every file that is needed to build, simulate and calibrate a rig, from its parameters."""

from pathlib import Path

import click

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.hardware_file import parameters_to_text, read_checked
from cathxr.app.hardware_folder import check_place, folder_made_whole
from cathxr.app.hardware_params import PARAMS_OPTION
from cathxr.app.hardware_progress import shown_progress
from cathxr.app.page_options import PATH
from cathxr.hardware.bill import bill_csv, bill_markdown, bill_rows
from cathxr.hardware.holes import nominal_phantom
from cathxr.hardware.layout import Layout
from cathxr.hardware.nominal import nominal_rig
from cathxr.storage.phantom_text import phantom_to_text
from cathxr.storage.rig_file import rig_to_text


@click.command("export")
@click.option("--out", type=PATH, required=True, metavar="DIR", help="The folder to make, or to make anew.")
@PARAMS_OPTION
@told_in_a_sentence
def export(out: Path, params_path: Path | None) -> None:
    """Write everything that is needed to build a rig into DIR, whole or not at all.

    print/: STL and 3MF as they lie on the bed; step/; cut/: DXF and SVG with kerf, and the sheets
    as STL and 3MF; assembly.step and assembly.glb;
    bill.csv and bill.md; rig.toml, which the twin and the calibration start from; phantom.toml; params.toml.

    \b
    Examples:
      cathxr hardware export --out rig/
      cathxr hardware export --params params.toml --out rig/
    """
    check_place(out)
    layout, _ = read_checked(params_path)
    with shown_progress() as report, folder_made_whole(out) as part:
        report("Loading the CAD kernel", None)
        from cathxr.hardware.cad.assembly import rig_3d
        from cathxr.hardware.cad.export import export_rig, made_parts

        report("Making the solids", None)
        rig = rig_3d(layout)
        export_rig(rig, part, report=report)
        write_texts(layout, part)
        rows = bill_rows(layout, made_parts(rig))
        _write(part / "bill.csv", bill_csv(rows))
        _write(part / "bill.md", bill_markdown(layout, rows))
        count = sum(1 for each in part.rglob("*") if each.is_file())
    click.echo(f"Written: {count} files for {len(rig.made())} kinds of printed parts in {out}; bill.md lists the rest.")


def write_texts(layout: Layout, folder: Path) -> None:
    """Write params.toml, rig.toml and phantom.toml into a folder."""
    _write(folder / "params.toml", parameters_to_text(layout.parameters))
    _write(folder / "rig.toml", rig_to_text(nominal_rig(layout)))
    _write(folder / "phantom.toml", phantom_to_text(nominal_phantom(layout)))


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
