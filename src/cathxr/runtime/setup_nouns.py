"""What one check of the set-up says: the same for `cathxr doctor`, for its tables, and for the page /setup."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["good", "warn", "wrong", "unknown"]
Subject = Literal["cameras", "which", "light", "focus", "markers", "encoder", "network", "headset", "rig"]
SUBJECTS: tuple[Subject, ...] = (
    "cameras", "which", "light", "focus", "markers", "encoder", "network", "headset", "rig",
)  # fmt: skip
"""In the order in which a new owner goes through them."""


@dataclass(frozen=True)
class SetupCheck:
    """One check. verdict: "warn" is not needed for everything, "unknown" could not be told from what is there now.

    title: what was looked at; found: what was measured; then: what to do, empty where nothing is to be done.
    camera: "top" or "front" where it is about one of them. t_ns: when it was measured; None: it is of this moment.
    """

    subject: Subject
    title: str
    verdict: Verdict
    found: str
    then: str = ""
    camera: Literal["", "top", "front"] = ""
    t_ns: int | None = None
