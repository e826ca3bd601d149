"""The heart as the scene tells it: surfaces, volumes, names, places to reach, and the files that hold them."""

from pathlib import Path

import numpy as np

from cathxr.core import FloatArray, Roi
from cathxr.heart import HeartFolder
from cathxr.heart.acoustic_codes import Scale
from cathxr.heart.acoustic_file import read_acoustic
from cathxr.heart.anatomy import CATALOGUE
from cathxr.heart.label_texture import label_texture
from cathxr.heart.labels_file import read_labels
from cathxr.registration import Registration
from cathxr.wire.message import Matrix4, Vector3
from cathxr.wire.messages import (
    AcousticDescription,
    HeartDescription,
    LabelDescription,
    LabelsDescription,
    LandmarkDescription,
    PartDescription,
    RegistrationDescription,
    ScaleDescription,
    TargetDescription,
)
from cathxr.wire.packed import Packed
from cathxr.wire.scene import pose_description

GLB, ACOUSTIC, LABELS = "/scene/heart.glb", "/scene/acoustic.bin", "/scene/labels.bin"
_TARGET_RADIUS_MM = 3.0

Files = dict[str, Path | Packed]


def heart_scene(heart: HeartFolder, registration: Registration) -> tuple[HeartDescription, Files]:
    """Return a heart's description and the files that it names.

    Raises:
        DataError: the acoustic volume's file or the labels' is damaged.
    """
    files: Files = {GLB: heart.glb}
    description = HeartDescription(
        glb=GLB,
        parts=[
            PartDescription(name=key, label=each.name, node=each.node, colour=each.colour, opacity=each.opacity)
            for key, each in heart.structures.items()
        ],
        attribution=f"{heart.source.title}; {heart.source.authors}; {heart.source.licence}",
        registration=registration_description(registration),
        acoustic=_acoustic(heart, files),
        labels=_labels(heart, files),
        landmarks=_landmarks(heart),
    )
    return description, files


def heart_targets(heart: HeartFolder, registration: Registration, roi: Roi) -> list[TargetDescription]:
    """Return the named places of a heart that lie in the box's region."""
    targets = []
    for key, point in heart.points_ct.items():
        place = registration.box(point[None])[0]
        if (place < roi.min_mm).any() or (place > roi.max_mm).any():
            continue
        opening = heart.openings.get(key)
        normal = None
        if opening is not None:
            # A plane's normal is turned by the transpose of what takes the box to ct, also where that stretches.
            turned = (registration.ct(np.eye(3)) - registration.ct(np.zeros((1, 3)))) @ opening.normal
            normal = _vector(turned / np.linalg.norm(turned))
        targets.append(
            TargetDescription(
                name=key,
                position_mm=_vector(place),
                radius_mm=_TARGET_RADIUS_MM,
                label=heart.landmarks[key].name if opening is None else opening.name,
                normal=normal,
                diameter_mm=None if opening is None else opening.diameter_mm,
            )
        )
    return targets


def registration_description(registration: Registration) -> RegistrationDescription:
    """Return a registration as the scene tells it."""
    linear = None
    if registration.linear is not None:
        rows = [(float(x), float(y), float(z)) for x, y, z in registration.linear]
        linear = (rows[0], rows[1], rows[2])
    return RegistrationDescription(
        kind=registration.kind.value,
        ct_from_box=pose_description(registration.ct_from_box),
        scale=registration.scale,
        linear=linear,
        fre_mm=registration.fre_mm,
        tre_mm=registration.tre_mm,
        predicted_tre_mm=registration.predicted_tre_mm,
        worst_tre_mm=registration.worst_tre_mm,
        date=registration.date,
    )


def _acoustic(heart: HeartFolder, files: Files) -> AcousticDescription | None:
    """Return what tells of the acoustic volume, and put its file, which is checked first, among `files`."""
    if heart.acoustic is None:
        return None
    volume = read_acoustic(heart.acoustic)
    files[ACOUSTIC] = Packed(heart.acoustic.file.read_bytes(), volume.rgba.size)
    k, j, i = heart.acoustic.shape
    scales = {channel: _scale(scale) for channel, scale in heart.acoustic.scales.items()}
    matrix = _matrix(heart.acoustic.ct_from_voxel)
    return AcousticDescription(file=ACOUSTIC, size=(i, j, k), ct_from_voxel=matrix, **scales)


def _labels(heart: HeartFolder, files: Files) -> LabelsDescription | None:
    """Return what tells of the labels, and put them, made small enough for a browser, among `files`."""
    if heart.labels is None:
        return None
    names = {each.label: key for key, each in heart.structures.items()}
    volume = label_texture(read_labels(heart.labels, names))
    files[LABELS] = Packed.of(volume.labels.tobytes())
    k, j, i = volume.labels.shape
    return LabelsDescription(
        file=LABELS,
        size=(i, j, k),
        ct_from_voxel=_matrix(volume.grid.ct_from_voxel),
        values=[
            LabelDescription(
                value=each.label,
                name=key,
                label=each.name,
                colour=each.colour,
                is_blood=CATALOGUE[key].blood if key in CATALOGUE else True,
            )
            for key, each in heart.structures.items()
            if each.label in volume.names
        ],
    )


def _landmarks(heart: HeartFolder) -> list[LandmarkDescription]:
    openings = [
        LandmarkDescription(
            name=key,
            label=each.name,
            kind="opening",
            position_ct=_vector(each.centroid_mm),
            normal_ct=_vector(each.normal),
            diameter_mm=each.diameter_mm,
            structure=each.structure,
        )
        for key, each in heart.openings.items()
    ]
    points = [
        LandmarkDescription(
            name=key, label=each.name, kind="landmark", position_ct=_vector(each.position_mm),
            normal_ct=None, diameter_mm=None, structure=None,
        )
        for key, each in heart.landmarks.items()
    ]  # fmt: skip
    return openings + points


def _scale(scale: Scale) -> ScaleDescription:
    return ScaleDescription(**vars(scale))


def _vector(values: FloatArray) -> Vector3:
    x, y, z = np.round(values, 6).tolist()
    return x, y, z


def _matrix(matrix: FloatArray) -> Matrix4:
    a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p = np.round(matrix, 9).ravel().tolist()  # noqa: E741
    return a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p
