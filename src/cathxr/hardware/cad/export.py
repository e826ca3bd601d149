"""Every file of a rig's solids: print, STEP, laser, assembly. Writes into a folder that the caller moves into place."""

from collections.abc import Callable, Iterable
from pathlib import Path

import build123d as b

from cathxr.hardware.bill import MadePart
from cathxr.hardware.cad.assembly import Rig3d
from cathxr.hardware.cad.checks import Progress, mesh_of
from cathxr.hardware.cad.part import BOUGHT, CUT, JIG, PHANTOM, PRINTED, SOFT, Place
from cathxr.hardware.cutting import dxf_text, svg_text
from cathxr.hardware.meshes import TriangleMesh
from cathxr.hardware.meshfiles import Node, glb_bytes, printable, stl_bytes, threemf_bytes
from cathxr.hardware.panels import panels
from cathxr.hardware.purchase import DENSITY_G_CM3

_FINE_MM, _COARSE_MM = 0.02, 0.1


def export_rig(rig: Rig3d, folder: Path, *, report: Progress) -> None:
    """Write print/ (STL, 3MF), step/, cut/ (DXF, SVG, STL, 3MF), assembly.step and assembly.glb into a folder.

    Raises:
        OSError: it cannot be written.
    """
    for name in ("print", "step", "cut"):
        (folder / name).mkdir()
    made = rig.made()
    coarse: dict[str, TriangleMesh] = {}
    for index, (key, part) in enumerate(rig.parts.items()):
        report(f"Writing {key}", 0.75 * index / len(rig.parts))
        coarse[key] = mesh_of(part.solid, tolerance_mm=_COARSE_MM)
        if part.kind == BOUGHT:
            continue
        _write_step(part.solid, folder / "step" / f"{key}.step", part.title)
        place = folder / ("print" if key in made else "cut") / key
        mesh = printable(mesh_of(part.solid, tolerance_mm=_FINE_MM), part.print_up)
        place.with_name(f"{key}.stl").write_bytes(stl_bytes(mesh, part.title))
        place.with_name(f"{key}.3mf").write_bytes(threemf_bytes(mesh, part.title))
    for panel in panels(rig.layout):
        kerf = rig.layout.parameters.panel.kerf_mm
        (folder / "cut" / f"{panel.key}.dxf").write_text(dxf_text(panel, kerf), encoding="ascii", newline="\n")
        (folder / "cut" / f"{panel.key}.svg").write_text(svg_text(panel, kerf), encoding="utf-8", newline="\n")
    report("Writing the assembly", 0.8)
    # Both crosses are in; phantom and jig are not, as they take the same room.
    places = [each for each in rig.places if each.setup not in (PHANTOM, JIG)]
    write_assembly(places, folder / "assembly.step", rig.layout.parameters.name)
    nodes = [
        Node(f"{each.part.key}.{index}", each.part.key, each.columns, each.origin, each.setup or each.group)
        for index, each in enumerate(rig.places)
    ]
    colours = {key: part.colour for key, part in rig.parts.items()}
    used = {each.mesh: coarse[each.mesh] for each in nodes}
    (folder / "assembly.glb").write_bytes(glb_bytes(used, colours, nodes))


def made_parts(rig: Rig3d) -> list[MadePart]:
    """Return what is printed and cut, with masses of full parts."""
    counts = rig.counts
    names: dict[str, str] = {PRINTED: "printed", SOFT: "soft", CUT: "cut"}
    return [
        MadePart(key, part.title, names[part.kind], counts[key],
                 part.solid.volume * 1e-3 * DENSITY_G_CM3[names[part.kind]], part.note)
        for key, part in rig.parts.items()
        if part.kind in names
    ]  # fmt: skip


def write_assembly(places: Iterable[Place], path: Path, name: str) -> None:
    """Write placed parts as one STEP, with their names and colours.

    Raises:
        OSError: it cannot be written.
    """
    children = []
    for each in places:
        solid = each.solid()
        solid.label = each.part.key
        solid.color = b.Color(*each.part.colour)
        children.append(solid)
    _write_step(b.Compound(label=name, children=children), path, name)


def _write_step(solid: b.Shape, path: Path, title: str) -> None:
    solid.label = solid.label or title
    write: Callable[..., bool] = b.export_step
    if not write(solid, str(path), timestamp="2000-01-01T00:00:00"):
        raise OSError(f"the CAD kernel could not write {path.name}")
