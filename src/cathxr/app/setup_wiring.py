"""Puts the walk through the set-up beside a live system."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from cathxr.app.live_parts import LiveParts
from cathxr.core import Clock, ConfigError, Rig
from cathxr.runtime.live import LiveSystem
from cathxr.runtime.setup_session import SetupSession, Surroundings
from cathxr.wire.hub import Hub
from cathxr.wire.network import lan_addresses

NAME = "setup"


def setup_beside(system: LiveSystem, parts: LiveParts, *, clock: Clock, hub: Hub, lan: bool) -> SetupSession:
    """Return the checks of a live system's set-up, connected to it and not yet entered.

    lan: whether the network is served.
    """
    around = Surroundings(headsets=hub.people.headsets, addresses=lan_addresses, lan=lan)
    session = SetupSession(_as_run(parts), station=system, clock=clock, publish=hub.publish_setup, around=around)
    if parts.optical is None:
        system.commands.add("setup_check", _refused)
        return session
    system.moments.add(NAME, session.take)
    parts.optical.readings.add(NAME, session.hear)
    for name, command in session.commands().items():
        system.commands.add(name, command)
    return session


def _as_run(parts: LiveParts) -> Rig:
    """Return the rig with the pictures' rate that is asked of its cameras here."""
    most_hz = parts.picture_hz
    if most_hz is None:
        return parts.rig
    cameras = {name: replace(each, rate_hz=min(each.rate_hz, most_hz)) for name, each in parts.rig.cameras.items()}
    return replace(parts.rig, cameras=cameras)


def _refused(args: Mapping[str, Any]) -> Mapping[str, Any]:
    raise ConfigError("A replay has no devices to check: start cathxr run with --source cameras, or twin.")
