"""The pairing code: right, wrong, and how long guessing is locked out."""

import pytest

from cathxr.core import ProtocolError
from cathxr.devices.clock import ManualClock
from cathxr.wire.pairing import ATTEMPTS, LOCK_S, TOTAL_ATTEMPTS, Pairing, new_code


def test_codes_are_six_digits_and_differ() -> None:
    codes = {new_code() for _ in range(50)}
    assert all(len(code) == 6 and code.isdecimal() for code in codes)
    assert len(codes) > 40  # 50 of a million agree in more than nine less often than once in 10^40


@pytest.mark.parametrize("given", ["012345", " 012 345 ", "012-345"])
def test_the_right_code_is_taken_as_people_write_it(given: str) -> None:
    Pairing("012345", ManualClock()).check("a", given)


def test_an_address_is_locked_out_and_let_in_again() -> None:
    clock = ManualClock()
    pairing = Pairing("012345", clock)
    for _ in range(ATTEMPTS):
        with pytest.raises(ProtocolError, match="not the pairing code"):
            pairing.check("a", "999999")
        clock.advance_ns(1_000_000_000)
    with pytest.raises(ProtocolError, match=f"wait {LOCK_S - ATTEMPTS:.0f} s"):
        pairing.check("a", "012345")
    pairing.check("b", "012345")  # others are not locked out
    clock.advance_ns(int((LOCK_S - ATTEMPTS) * 1e9) + 1)
    pairing.check("a", "012345")


def test_many_addresses_share_one_limit() -> None:
    clock = ManualClock()
    pairing = Pairing("012345", clock)
    for number in range(TOTAL_ATTEMPTS):
        with pytest.raises(ProtocolError, match="not the pairing code"):
            pairing.check(f"address {number}", "999999")
    with pytest.raises(ProtocolError, match="Too many"):
        pairing.check("fresh", "012345")
    clock.advance_ns(int(LOCK_S * 1e9) + 1)
    pairing.check("fresh", "012345")


@pytest.mark.parametrize("code", ["", "12345", "1234567", "12345a", "１２３４５６"])
def test_a_code_of_another_form_cannot_be_set(code: str) -> None:
    with pytest.raises(ValueError, match="six digits"):
        Pairing(code, ManualClock())
