"""What a study store says about itself and about what it did."""

from dataclasses import dataclass


@dataclass(frozen=True)
class StoredDesign:
    """A design as it was adopted. version: 1, 2, …; text: study.toml's; reason: why it replaced the one before."""

    version: int
    text: str
    sha256: str
    reason: str
    adopted: str


@dataclass(frozen=True)
class LogEntry:
    """One thing that was done to a study. participant: "" where it was about none, or one that was deleted since."""

    at: str
    what: str
    participant: str
    detail: str


@dataclass(frozen=True)
class Deleted:
    """What went with a participant. shared: folders that stay, as they hold other participants' trials too."""

    trials: int
    answers: int
    sessions: tuple[str, ...]
    shared: tuple[str, ...]
