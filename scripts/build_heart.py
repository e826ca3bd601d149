"""Rebuilds the built-in heart (heart.glb, heart.toml, registration.toml) from the STL surfaces of `heart_rodero01`.

    python scripts/build_heart.py --source ../shared/data/heart_rodero01/derived_stl

Needs the extra `heart`. The same surfaces and library versions give the same bytes.
"""

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np

from cathxr.core import CathxrError, DataError, FloatArray
from cathxr.heart import HeartFolder, HeartSource, Landmark, Opening, Structure, builtin_path, heart_toml
from cathxr.heart.glb import Part, encode_glb
from cathxr.heart.lumen import lumen
from cathxr.heart.simplify import simplified
from cathxr.heart.surface import (
    Surface,
    enclosed_volume_ml,
    largest_component,
    open_at,
    read_stl,
    smoothed,
    vertex_normals,
)
from cathxr.registration import default_placement, registration_toml

SMOOTHING_ROUNDS = 20
KEPT_SHARE = 0.45
ROUND_MM = 3
PLACEMENT_DATE = "2026-11-22"
PLACEMENT_METHOD = (
    "default placement, nothing measured: the inlet at the centre of the inferior vena cava's opening, +x towards the "
    "centre of the superior vena cava's, +z as near to anterior as that allows"
)
NAME = "Built-in heart: a healthy adult, four chambers, end diastole"
SOURCE = HeartSource(
    title="rodero_01_fullheart_1.5mm.vtu, distributed with ansys-health-heart 0.16.2",
    authors="Rodero et al., Linking statistical shape models and simulated function in the healthy adult human heart, "
    "PLoS Computational Biology 2021; mesh preparation: ANSYS, Inc. and affiliates",
    url="https://doi.org/10.5281/zenodo.4590294",
    licence="CC BY 4.0 (cohort), MIT (ansys-health-heart)",
    licence_url="https://creativecommons.org/licenses/by/4.0/",
    changes="Surfaces of the blood pools and great vessels extracted, opened at valves and vessels, smoothed, "
    "simplified, coloured, converted to glTF.",
)


@dataclass(frozen=True)
class Recipe:
    """How one structure is made. openings: key here → key in caps.json. straight_mm, rings, …: see `lumen`."""

    structure: Structure
    stl: str
    openings: Mapping[str, str]
    straight_mm: float = 0.0
    rings: int = 0
    before_mm: float = 0.0


def _chamber(structure: Structure, stl: str, **openings: str) -> Recipe:
    return Recipe(structure, stl, openings)


CHAMBERS = (
    _chamber(
        Structure("left_ventricle", "Left ventricle", 1, "left_ventricle", "#bf3a3a", 0.4),
        "lv_cavity.stl",
        mitral_valve="mitral-valve",
        aortic_valve="aortic-valve",
    ),
    _chamber(
        Structure("right_ventricle", "Right ventricle", 2, "right_ventricle", "#3f6fc4", 0.35),
        "rv_cavity.stl",
        tricuspid_valve="tricuspid-valve",
        pulmonary_valve="pulmonary-valve",
    ),
    _chamber(
        Structure("left_atrium", "Left atrium", 3, "left_atrium", "#e8917c", 0.4),
        "la_cavity.stl",
        mitral_valve_atrial_side="mitral-valve-atrium",
        right_superior_pulmonary_vein="right-superior-pulmonary-vein",
        right_inferior_pulmonary_vein="right-inferior-pulmonary-vein",
        left_superior_pulmonary_vein="left-superior-pulmonary-vein",
        left_inferior_pulmonary_vein="left-inferior-pulmonary-vein",
        left_atrial_appendage="left-atrium-appendage",
    ),
    _chamber(
        Structure("right_atrium", "Right atrium", 4, "right_atrium", "#5fb0d0", 0.3),
        "ra_cavity.stl",
        tricuspid_valve_atrial_side="tricuspid-valve-atrium",
        superior_vena_cava="superior-vena-cava",
        inferior_vena_cava="inferior-vena-cava",
    ),
)
VESSELS = (
    Recipe(
        Structure("aorta", "Ascending aorta", 5, "aorta", "#e0564f", 0.5),
        "aorta_wall.stl",
        {"aortic_valve": "aortic-valve"},
        straight_mm=33.0,
        rings=16,
        before_mm=1.0,
    ),
    Recipe(
        Structure("pulmonary_artery", "Pulmonary artery", 6, "pulmonary_artery", "#7f86d9", 0.5),
        "pulmonary_artery_wall.stl",
        {"pulmonary_valve": "pulmonary-valve"},
        straight_mm=8.0,
        rings=8,
        before_mm=3.5,
    ),
)
APICES = {
    "left_ventricle_apex": ("Apex of the left ventricle", "left_ventricle", "mitral_valve"),
    "right_ventricle_apex": ("Apex of the right ventricle", "right_ventricle", "tricuspid_valve"),
}


def _caps(source: Path) -> dict[str, dict[str, object]]:
    """Return caps.json: for each opening its centroid, area and equivalent diameter."""
    path = source / "caps.json"
    try:
        content: dict[str, dict[str, object]] = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror}); give the folder of STL surfaces.") from error
    except ValueError as error:
        raise DataError(f"{path} is not JSON ({error}); copy it again.") from error
    return content


def _opening(key: str, structure: str, cap: Mapping[str, object], normal: FloatArray) -> Opening:
    """Return an opening from its entry in caps.json and its measured outward normal."""
    name = key.replace("_", " ").capitalize().replace(" atrial side", ", atrial side")
    diameter = float(str(cap["eq_diameter_mm"]))
    return Opening(key, name, structure, np.array(cap["centroid_mm"]), normal, diameter)


def _rounded(surface: Surface) -> Surface:
    return Surface(np.round(surface.vertices_mm, ROUND_MM), surface.triangles)


def _part(structure: Structure, surface: Surface) -> Part:
    return Part(
        structure.node,
        surface.vertices_mm,
        vertex_normals(surface),
        surface.triangles,
        structure.colour,
        structure.opacity,
    )


def _farthest(surface: Surface, point: FloatArray) -> FloatArray:
    """Return the vertex (3,) farthest from a point, mm."""
    distance = np.linalg.norm(surface.vertices_mm - point, axis=1)
    return np.asarray(np.round(surface.vertices_mm[int(distance.argmax())], 2))


def build(source: Path, out: Path) -> list[str]:
    """Write the heart folder and return a line of figures for each part."""
    caps = _caps(source)
    parts: list[Part] = []
    lines: list[str] = []
    structures: dict[str, Structure] = {}
    openings: dict[str, Opening] = {}
    whole: dict[str, Surface] = {}
    for recipe in CHAMBERS:
        key = recipe.structure.key
        pool = whole[key] = read_stl(source / recipe.stl)
        opened = pool
        for name, cap in recipe.openings.items():
            opened, normal = open_at(opened, np.array(caps[cap]["centroid_mm"]))
            openings[name] = _opening(name, key, caps[cap], normal)
        volume = round(enclosed_volume_ml(pool), 1)
        smooth = smoothed(largest_component(opened), SMOOTHING_ROUNDS)
        light = _rounded(simplified(smooth, int(KEPT_SHARE * len(smooth.triangles))))
        structures[key] = Structure(**{**vars(recipe.structure), "volume_ml": volume})
        parts.append(_part(recipe.structure, light))
        shown = enclosed_volume_ml(light)
        lines.append(f"{key}: {len(light.triangles)} triangles, {shown:.1f} mL of {volume} mL")
    for recipe in VESSELS:
        valve = openings[next(iter(recipe.openings))]
        wall = read_stl(source / recipe.stl)
        tube = lumen(
            wall,
            valve.centroid_mm,
            valve.normal,
            straight_mm=recipe.straight_mm,
            rings=recipe.rings,
            before_mm=recipe.before_mm,
        )
        structures[recipe.structure.key] = recipe.structure
        parts.append(_part(recipe.structure, _rounded(tube)))
        lines.append(f"{recipe.structure.key}: {len(tube.triangles)} triangles")
    landmarks = {
        key: Landmark(key, name, _farthest(whole[structure], openings[valve_key].centroid_mm))
        for key, (name, structure, valve_key) in APICES.items()
    }
    heart = HeartFolder(out, NAME, SOURCE, structures, openings, out / "heart.glb", landmarks)
    placement = default_placement(
        openings["inferior_vena_cava"].centroid_mm,
        openings["superior_vena_cava"].centroid_mm,
        method=PLACEMENT_METHOD,
        date=PLACEMENT_DATE,
    )
    glb = encode_glb(parts, f"{SOURCE.authors}. {SOURCE.licence}. {SOURCE.url}", "cathxr scripts/build_heart.py")
    out.mkdir(parents=True, exist_ok=True)
    _replace(out / "heart.glb", glb)
    _replace(out / "heart.toml", ("# Written by scripts/build_heart.py.\n" + heart_toml(heart)).encode())
    _replace(out / "registration.toml", registration_toml(placement).encode())
    total = sum(len(part.triangles) for part in parts)
    return [*lines, f"heart.glb: {total} triangles, {len(glb) / 1e6:.2f} MB"]


def _replace(path: Path, content: bytes) -> None:
    """Write a file so that an interruption leaves the old one."""
    beside = path.with_name(path.name + ".part")
    beside.write_bytes(content)
    os.replace(beside, path)


@click.command()
@click.option("--source", type=click.Path(path_type=Path), required=True, help="Folder of the STL files and caps.json.")
@click.option("--out", type=click.Path(path_type=Path), default=builtin_path(), help="Heart folder to write.")
def main(source: Path, out: Path) -> None:
    """Rebuild the built-in heart from its STL surfaces."""
    try:
        for line in build(source, out):
            click.echo(line)
    except CathxrError as error:
        raise click.ClickException(str(error)) from error


if __name__ == "__main__":
    main()
