"""The messages of the page on which a heart's seeds are placed: one state, of which only the newest matters."""

from typing import Literal

from pydantic import Field

from cathxr.wire.message import Message, Vector3


class SlicePlane(Message):
    """One of the three planes, as it is seen. Its slices are at /heart/ct/{name}/{index}.bin."""

    name: Literal["axial", "coronal", "sagittal"]
    columns: int
    rows: int
    slices: int
    spacing_mm: Vector3 = Field(description="To the next column, row and slice.")
    letters: tuple[str, str, str, str] = Field(description="Of the left, right, upper and lower side: R L A P H F.")


class HeartStructure(Message):
    """A structure that a seed may name, or that the labels show."""

    key: str
    name: str
    colour: str
    label: int = Field(description="Its value in the slices of the labels; 0: it has none there.")
    seedable: bool = Field(description="Whether a seed may name it.")
    volume_ml: float | None = Field(description="In the labels that are shown; null where they do not have it.")
    before_ml: float | None = Field(description="In the labels before these.")


class HeartSeed(Message):
    """One seed. id: for the commands."""

    id: int
    structure: str
    position_mm: Vector3 = Field(description="mm, ct")
    seen: Vector3 = Field(description="Voxels as seen: x to the patient's left, y to the back, z to the feet.")
    radius_mm: float | None
    hu: int = Field(description="Of the voxel it lies in.")
    labelled: str = Field(description="Key of the structure that the labels have there; empty: none.")


class HeartSeedsState(Message):
    """Seeds being placed in a heart's CT."""

    type: Literal["heart_seeds"] = "heart_seeds"
    stage: Literal["ready", "segmenting", "failed"]
    advice: str = Field(description="What to do next, or what went wrong: one sentence for a person.")
    progress: float | None = Field(description="Share of the segmentation that is done; null where it is not known.")
    doing: str = Field(description="What the segmentation does now.")
    planes: list[SlicePlane]
    ct_from_seen: list[Vector3] = Field(description="Millimetres in ct of one voxel along x, y, z; and of voxel 0.")
    tilt_deg: float = Field(description="The largest angle between the slices' axes and the patient's.")
    structures: list[HeartStructure]
    seeds: list[HeartSeed]
    labels_version: int = Field(description="For /heart/labels/{version}/{name}/{index}.bin; 0: no labels yet.")
    labels_box: list[Vector3] = Field(description="First and last voxel, as seen, of what is labelled; empty: nothing.")
    labels_from: Literal["nothing", "file", "segmentation"]
    is_current: bool = Field(description="The labels were made with these seeds.")
    findings: list[str] = Field(description="What the segmentation could not do, and what helps: sentences.")
    can_undo: bool
    can_redo: bool
    saved: bool = Field(description="The seeds file holds these seeds.")
