"""What a command says of Ctrl-C and of faults of its own, and the exit code."""

import pytest

from cathxr.app.errors import FAULT, INTERRUPTED, told_in_a_sentence


def test_ctrl_c_in_compiled_code_is_told_as_ctrl_c(monkeypatch, capsys):
    """Python raises SystemError from the interruption where the signal arrives as compiled code returns."""

    @told_in_a_sentence
    def interrupted():
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.delenv("CATHXR_DEBUG", raising=False)
    with pytest.raises(SystemExit) as left:
        interrupted()
    assert left.value.code == INTERRUPTED
    assert capsys.readouterr().err == "Interrupted: stopped, and nothing half-written is left.\n"


def test_a_fault_of_our_own_is_told_with_a_way_to_see_it(monkeypatch, capsys):
    @told_in_a_sentence
    def broken():
        raise RuntimeError("oops")

    monkeypatch.delenv("CATHXR_DEBUG", raising=False)
    with pytest.raises(SystemExit) as left:
        broken()
    assert left.value.code == FAULT
    assert "CATHXR_DEBUG=1" in capsys.readouterr().err
    monkeypatch.setenv("CATHXR_DEBUG", "1")
    with pytest.raises(RuntimeError, match="oops"):
        broken()
