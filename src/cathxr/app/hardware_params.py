"""`cathxr hardware params`: what a set of parameters is worth, as a table; and params.toml to begin with."""

from collections.abc import Iterator
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from cathxr.app.errors import told_in_a_sentence
from cathxr.app.hardware_file import parameters_to_text, read_checked
from cathxr.app.page_options import PATH
from cathxr.hardware.layout import Layout
from cathxr.hardware.rules import Figures
from cathxr.storage.atomic import check_writable, written_whole

PARAMS_OPTION = click.option("--params", "params_path", type=PATH, help="The parameters (params.toml).")


@click.command("params")
@PARAMS_OPTION
@click.option("--out", type=PATH, help="Write all parameters into this file, to change them there.")
@told_in_a_sentence
def params(params_path: Path | None, out: Path | None) -> None:
    """Show what a rig of these parameters would be worth. No CAD kernel is needed.

    \b
    Examples:
      cathxr hardware params
      cathxr hardware params --out params.toml
      cathxr hardware params --params params.toml
    """
    layout, found = read_checked(params_path)
    if out is not None:
        check_writable(out, what="the parameters")
        with written_whole(out) as part:
            part.write_text(parameters_to_text(layout.parameters), encoding="utf-8", newline="\n")
    show_figures(Console(), layout, found)
    if out is not None:
        click.echo(f"Written: {out}")


def show_figures(console: Console, layout: Layout, found: Figures) -> None:
    """Print what a rig is worth."""
    table = Table(title=f"What {layout.parameters.name!r} would be", title_justify="left", show_header=False)
    for what, value in figure_lines(layout, found):
        table.add_row(what, value)
    console.print(table)


def figure_lines(layout: Layout, found: Figures) -> Iterator[tuple[str, str]]:
    """Yield a rig's figures as pairs of texts."""
    parameters = layout.parameters
    camera, gear = parameters.camera, parameters.gear
    least, most = found.play_deg[1:]
    beams = f", each beam of {found.segments} pieces" if found.segments > 1 else ""
    yield "frame", f"cube of {found.outer_mm:.0f} mm, {layout.beam_mm:.0f} mm inside{beams}"
    yield "ROI", f"{parameters.roi.side_mm:g} mm; cameras {camera.distance_mm:g} mm from its centre"
    yield (
        "lens",
        f"{camera.focal_mm:g} mm = {layout.focal_px:.0f} px; {found.mm_per_px:.3f} mm a pixel at the centre",
    )
    yield (
        "field of view",
        (
            f"{found.view_mm[0]:.0f} x {found.view_mm[1]:.0f} mm at the ROI's near face, of which the ROI takes "
            f"{100 * found.roi_share:.0f} % of the height"
        ),
    )
    yield "sharp", f"{found.sharp_mm[0]:.0f} to {found.sharp_mm[1]:.0f} mm at f/{camera.f_number:g}"
    yield "catheter", f"{parameters.catheter.name}, {found.catheter_px:.1f} px wide; bore {layout.bore_mm:.2f} mm"
    yield (
        "rays on the diffuser",
        (
            f"{100 * found.lit.of_places:.1f} % of those to the ROI ({100 * found.lit.without_inlet:.1f} % but "
            f"for the inlet block); {100 * found.lit.of_picture:.1f} % of the ROI's picture"
        ),
    )
    yield (
        "gears",
        (
            f"{gear.catheter_teeth}:{gear.encoder_teeth}, {found.degrees_per_count:.4f} degrees a count; play "
            f"{found.play_deg[0]:.2f} degrees without the spring ({least:.2f} to {most:.2f} with the centres "
            f"{gear.centre_error_mm:g} mm off); {found.contact_ratio:.2f} teeth in contact at least"
        ),
    )
    yield "rods", f"8 of {layout.long_rod_mm:.0f} mm and 4 of {layout.short_rod_mm:.0f} mm"
