"""Puts training beside a live system: what it takes, what it hears, and what operators may ask of it."""

from cathxr.core import Clock
from cathxr.runtime.live import LiveSystem
from cathxr.runtime.training_commands import HELD, TrainingCommands
from cathxr.runtime.training_live import TrainingSession
from cathxr.runtime.training_nouns import Outlet, TrainingParts

NAME = "training"


def training_beside(system: LiveSystem, parts: TrainingParts, *, clock: Clock, outlet: Outlet) -> TrainingSession:
    """Return training for a live system, connected to it and not yet entered."""
    session = TrainingSession(parts, clock=clock, outlet=outlet, station=system)
    system.moments.add(NAME, session.take)
    system.events.add(NAME, session.hear)
    asked = TrainingCommands(session)
    for name, command in asked.named().items():
        system.commands.add(name, command)
    for name in HELD:
        system.commands.wrap(name, asked.guarded)
    return session
