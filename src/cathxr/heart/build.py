"""Builds a heart folder from labels: surfaces, labels, openings, landmarks, acoustic volume, quality page."""

import tomllib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import SimpleITK as sitk

from cathxr.heart.acoustic import acoustic_volume
from cathxr.heart.acoustic_codes import AcousticVolume
from cathxr.heart.acoustic_file import ACOUSTIC, write_acoustic
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.build_folder import replacing
from cathxr.heart.folder import heart_toml, read_heart
from cathxr.heart.glb import Part, Patch, encode_glb
from cathxr.heart.jobs import Together, one_after_another
from cathxr.heart.made import Made
from cathxr.heart.model import AcousticFile, HeartFolder, HeartSource, Structure
from cathxr.heart.openings import Places, find_places
from cathxr.heart.quality import write_quality
from cathxr.heart.surface import vertex_normals
from cathxr.heart.surfaces import PartSurface, surfaces_of
from cathxr.heart.surfaces.parts import FEWEST_VOXELS
from cathxr.heart.volume import LabelVolume, Progress, Volume, silent

GLB, TOML, LABELS = "heart.glb", "heart.toml", "labels.nii.gz"
REGISTRATION = "registration.toml"
_WORTH_TELLING_ML = 0.1


def build_heart(
    out: Path,
    *,
    volume: Volume | None,
    labels: LabelVolume,
    findings: Sequence[str] = (),
    source: HeartSource,
    name: str,
    budget: int = 150_000,
    places: Places | None = None,
    acoustic: AcousticVolume | None = None,
    registration: str | None = None,
    together: Together = one_after_another,
    progress: Progress = silent,
) -> HeartFolder:
    """Return the heart folder that was made of `labels` and now is at `out`; a heart that was there is replaced.

    volume: the CT that the labels lie on, on the same grid: shown on the quality page. findings: sentences for the
    page. budget: how many triangles all surfaces have together, about. places, acoustic: found, and made, from the
    labels and the volume unless they are given. registration: the text of a registration.toml to put into the folder.
    together: how what does not depend on each other is done; progress may then be called by several threads.
    The same input gives the same bytes. An interruption or a failure leaves what was at `out` as it was. A measured
    registration of a heart that was there is kept when its labels lie on the same grid: it then is in the same `ct`.

    Raises:
        DataError: the labels hold no structure, or `out` cannot be written or is something else than a heart folder.
        ValueError: the volume's grid is not the labels'.
    """
    if volume is not None and not _same_grid(volume, labels):
        raise ValueError(f"volume: expected the grid of the labels, {labels.grid.shape}, got {volume.grid.shape}")
    with replacing(out, keeps=lambda old: _kept(old, labels)) as folder:
        if places is None:
            progress("Looking for valves and vessels' mouths", 0.0)
            places = find_places(labels, volume=volume)
        openings = tuple(places.openings.values())
        told = _span(progress, 0.1, 0.6)
        parts = surfaces_of(labels, openings=openings, budget=budget, together=together, progress=told)
        made = Made(name, volume, labels, parts, places, (*findings, *_left_out(labels, parts)), source, budget)
        progress("Writing the labels and the surfaces", 0.6)
        (folder / GLB).write_bytes(_glb(made))
        written, _ = together(
            [
                lambda: _write_voxels(folder, made, acoustic, _span(progress, 0.6, 0.7)),
                lambda: write_quality(folder, made, together=together, progress=_span(progress, 0.7, 1.0)),
            ]
        )
        assert written is not None
        heart = _heart(folder, made, written)
        text = "# Written by cathxr heart build.\n" + heart_toml(heart)
        (folder / TOML).write_text(text, encoding="utf-8", newline="\n")
        if registration is not None:
            (folder / REGISTRATION).write_text(registration, encoding="utf-8", newline="\n")
    progress("The heart is ready", 1.0)
    return read_heart(out)


def structure_of(part: PartSurface) -> Structure:
    """Return what heart.toml says about a part."""
    anatomy = CATALOGUE[part.key]
    return Structure(
        key=part.key,
        name=anatomy.name,
        label=anatomy.label,
        node=part.key,
        colour=anatomy.colour,
        opacity=anatomy.opacity,
        volume_ml=round(part.checks.labels_ml, 2),
    )


def _left_out(labels: LabelVolume, parts: Sequence[PartSurface]) -> list[str]:
    """Return a sentence for each labelled structure that has no surface, and for each whose crumbs were dropped."""
    drawn = {part.key for part in parts}
    sentences = []
    for key in dict.fromkeys(labels.names.values()):
        voxels = labels.voxels(key)
        if key not in drawn and voxels:
            sentences.append(
                f"{CATALOGUE[key].name}: only {voxels} voxels are labelled, and {FEWEST_VOXELS} are needed for a "
                "surface; it was left out of the surfaces."
            )
    for part in parts:
        if part.checks.dropped_ml >= _WORTH_TELLING_ML:
            sentences.append(
                f"{CATALOGUE[part.key].name}: crumbs of {part.checks.dropped_ml:.2f} mL in all were left out of its "
                "surface; the labels still have them."
            )
    return sentences


def _heart(folder: Path, made: Made, acoustic: AcousticFile) -> HeartFolder:
    """Return what heart.toml says."""
    drawn = {part.key for part in made.parts}
    return HeartFolder(
        path=folder,
        name=made.name,
        source=made.source,
        structures={part.key: structure_of(part) for part in made.parts},
        openings={key: each for key, each in made.places.openings.items() if each.structure in drawn},
        glb=folder / GLB,
        landmarks=made.places.landmarks,
        labels=folder / LABELS,
        acoustic=acoustic,
        technical=None if made.volume is None else made.volume.technical,
    )


def _glb(made: Made) -> bytes:
    """Return the bytes of heart.glb."""
    source = made.source
    text = ". ".join(each for each in (source.authors, source.licence, source.url) if each)
    return encode_glb([_part(each) for each in made.parts], text, "cathxr heart build")


def _part(part: PartSurface) -> Part:
    """Return a part as the GLB has it: walls and caps apart, each with the normals of its own triangles."""
    anatomy = CATALOGUE[part.key]
    has_caps = bool(part.caps.any() and not part.caps.all())
    walls = part.surface.keep(~part.caps) if has_caps else part.surface
    caps = part.surface.keep(part.caps) if has_caps else None
    return Part(
        node=part.key,
        vertices_mm=walls.vertices_mm,
        normals=vertex_normals(walls),
        triangles=walls.triangles,
        colour=anatomy.colour,
        opacity=anatomy.opacity,
        caps=None if caps is None else Patch(caps.vertices_mm, vertex_normals(caps), caps.triangles),
    )


def _write_voxels(folder: Path, made: Made, acoustic: AcousticVolume | None, progress: Progress) -> AcousticFile | None:
    """Write the labels and the acoustic volume, made where it is not given; return what heart.toml says about it."""
    _write_labels(folder / LABELS, made.labels)
    if acoustic is None:
        acoustic = acoustic_volume(made.labels, volume=made.volume, openings=made.places.openings, progress=progress)
    return write_acoustic(folder / ACOUSTIC, acoustic)


def _write_labels(path: Path, labels: LabelVolume) -> None:
    """Write the labels with the catalogue's values as NIfTI."""
    lookup = np.zeros(256, np.uint8)
    for value, key in labels.names.items():
        lookup[value] = CATALOGUE[key].label
    image = sitk.GetImageFromArray(lookup[labels.labels])
    matrix, spacing = labels.grid.ct_from_voxel, labels.grid.spacing_mm
    image.SetSpacing([float(each) for each in spacing])
    image.SetOrigin([float(each) for each in matrix[:3, 3]])
    image.SetDirection([float(each) for each in (matrix[:3, :3] / spacing).reshape(-1)])
    sitk.WriteImage(image, str(path), useCompression=True)


def _kept(old: Path, labels: LabelVolume) -> tuple[str, ...]:
    """Return the files of a heart folder that a new heart of these labels takes over."""
    if not (old / LABELS).is_file() or not _is_measured(old / REGISTRATION):
        return ()
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(old / LABELS))
    try:
        reader.ReadImageInformation()
    except RuntimeError:
        return ()
    direction = np.array(reader.GetDirection()).reshape(3, 3) * np.array(reader.GetSpacing())
    same = tuple(reader.GetSize()) == labels.grid.shape[::-1]
    same = same and np.allclose(direction, labels.grid.ct_from_voxel[:3, :3], atol=1e-4)
    same = same and np.allclose(reader.GetOrigin(), labels.grid.ct_from_voxel[:3, 3], atol=1e-2)
    return (REGISTRATION,) if same else ()


def _is_measured(path: Path) -> bool:
    """Return whether there is a registration that somebody measured: what `placement` says, a new build says anew."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8")).get("kind") not in (None, "placement")
    except (OSError, ValueError):
        return False


def _same_grid(volume: Volume, labels: LabelVolume) -> bool:
    return volume.grid.shape == labels.grid.shape and np.allclose(
        volume.grid.ct_from_voxel, labels.grid.ct_from_voxel, atol=1e-3
    )


def _span(progress: Progress, first: float, last: float) -> Progress:
    """Return a progress that fills the part from `first` to `last` of another."""
    return lambda what, share: progress(what, None if share is None else first + (last - first) * share)
