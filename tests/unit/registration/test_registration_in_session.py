"""A recorded session keeps a copy of the registration that it was recorded with."""

import tomllib

import numpy as np
import pytest

from cathxr.app.config import Config
from cathxr.app.live_parts import live_parts
from cathxr.devices.clock import MonotonicClock
from cathxr.heart import builtin_path
from cathxr.registration import default_placement, registration_toml
from cathxr.runtime.recording import session_opener
from cathxr.storage.rig_file import example_rig
from cathxr.storage.session import SessionReader


def test_the_copy_is_read_back(tmp_path):
    placed = default_placement(np.array([20.0, 60.0, 30.0]), np.array([20.0, 60.0, 90.0]), method="a test")
    content = tomllib.loads(registration_toml(placed))
    for name, registration in (("with", content), ("without", None)):
        opened = session_opener(
            tmp_path, rig=example_rig(), config={}, clock=MonotonicClock(), videos=False, registration=registration
        )
        opened(name).close()
        assert SessionReader(tmp_path / name).registration == registration


def test_the_live_system_hands_over_that_of_its_heart(tmp_path):
    config = Config.model_validate({"recording": {"folder": str(tmp_path)}})
    parts = live_parts("twin", config, clock=MonotonicClock())
    parts.options.open_session("now").close()
    built_in = tomllib.loads((builtin_path() / "registration.toml").read_text(encoding="utf-8"))
    recorded = SessionReader(tmp_path / "now").registration
    assert recorded["kind"] == built_in["kind"]
    assert recorded["ct_from_box"]["translation_mm"] == pytest.approx(built_in["ct_from_box"]["translation_mm"])
