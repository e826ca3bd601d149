"""The message of the page /setup: every check of the set-up, of which only the newest state matters."""

from typing import Literal

from pydantic import Field

from cathxr.wire.message import Message


class SetupCheckState(Message):
    """One check of the set-up: what was looked at, what was found, what to do."""

    subject: Literal["cameras", "which", "light", "focus", "markers", "encoder", "network", "headset", "rig"]
    title: str
    verdict: Literal["good", "warn", "wrong", "unknown"] = Field(
        description="warn: not needed for everything; unknown: what is there now does not tell."
    )
    found: str = Field(description="What was measured.")
    then: str = Field(description="What to do; may be empty.")
    camera: Literal["", "top", "front"] = Field(description="The camera that it is about; empty: no single one.")
    t: float | None = Field(
        description="When it was measured, seconds of the host's monotonic clock; null: as of this message."
    )


class SetupState(Message):
    """How the set-up stands. Sent when an operator's command `setup_check` asks for it; the newest wins.

    `setup_check` takes `{pictures, said}`. pictures (true): look at new pictures too, else only at what is known at
    once. said: "right" or "swapped", what a person saw of which camera is which.
    """

    type: Literal["setup"] = "setup"
    t: float = Field(description="Seconds of the host's monotonic clock.")
    busy: bool = Field(description="Pictures are being looked at: another state follows.")
    checks: list[SetupCheckState]
