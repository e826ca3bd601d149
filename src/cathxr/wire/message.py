"""What every message is made of: the base class and the types of vectors on the link."""

from pydantic import BaseModel, ConfigDict

Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Matrix4 = tuple[
    float, float, float, float, float, float, float, float,
    float, float, float, float, float, float, float, float,
]  # fmt: skip
"""Sixteen numbers, row by row."""


class Message(BaseModel):
    """Common to all: unknown keys are refused, values are fixed once made."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
