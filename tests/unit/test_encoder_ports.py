"""The search for the encoder's port: what decides, what is said of every port tried, what a pseudo-terminal proves."""

import errno
import os
from types import SimpleNamespace

import pytest
import serial

from cathxr.core import DeviceLost, DeviceNotFound
from cathxr.devices import encoder_ports, encoder_serial
from cathxr.devices.clock import ManualClock, MonotonicClock
from cathxr.devices.encoder_fake import FakeBoard, FakePort
from cathxr.devices.encoder_fake_terminal import FakeTerminal
from cathxr.devices.encoder_ports import Candidate, Port, SerialPort, candidates, find_board, try_port, why_not_opened
from cathxr.devices.encoder_protocol import guarded
from cathxr.devices.encoder_serial import SerialEncoder
from cathxr.storage.rig_file import example_rig

posix_only = pytest.mark.skipif(os.name == "nt", reason="Windows has no pseudo-terminals")


class Says:
    """A port on which something says always the same."""

    def __init__(self, clock: ManualClock, what: bytes) -> None:
        self.name, self.closed, self.asked = "says", False, b""
        self._clock, self._what = clock, what

    def read(self, timeout_s: float) -> bytes:
        self._clock.advance_ns(round(timeout_s * 1e9) + 1000)
        return self._what

    def write(self, data: bytes) -> None:
        self.asked += data

    def close(self) -> None:
        self.closed = True


def usb(*devices: str) -> list[Candidate]:
    return [Candidate(each, "USB2.0-Serial", 0, True) for each in devices]


class Computer:
    """A computer whose ports are what is given: a port, or the reason why it cannot be opened."""

    def __init__(self, **ports: Port | str) -> None:
        self._ports = ports

    def open(self, name: str) -> Port:
        found = self._ports[name]
        if isinstance(found, str):
            raise DeviceNotFound(found)
        return found.open(name) if isinstance(found, FakePort) else found


def fake(clock: ManualClock) -> FakePort:
    return FakePort(FakeBoard(lambda t_ns: 0, start_ns=clock.now_ns()), clock, waits_s=1.7)


def test_what_it_says_decides() -> None:
    clock = ManualClock()
    other = Says(clock, b"gps $GPGGA,1,2,3\r\n")
    computer = Computer(A="another program has it open", B=other, C=fake(clock))
    found = find_board(clock, open_port=computer.open, ports=usb("A", "B", "C"))
    assert found.device == "C"
    assert found.port is not None
    assert other.closed


def test_every_port_tried_is_listed_with_its_reason() -> None:
    clock = ManualClock()
    computer = Computer(
        A="another program has it open",
        B=Says(clock, b"\xff\x00\n"),
        C=Says(clock, b""),
        D=Says(clock, guarded("I cathxr-roll 2 2.0.0 with news")),
        E=Says(clock, guarded("I stage-motor 1")),
    )
    ports = [*usb("A", "B", "C", "D", "E"), Candidate("ttyS0", "a serial port", 4, False)]
    with pytest.raises(DeviceNotFound) as failure:
        find_board(clock, open_port=computer.open, ports=ports)
    sentence = str(failure.value)
    for device, reason in {
        "A": "another program has it open",
        "B": "says something else",
        "C": "says nothing",
        "D": "protocol 2 and this program speaks 1: flash the firmware",
        "E": "it is a stage-motor",
        "ttyS0": "not tried, as it is no USB port",
    }.items():
        part = next(each for each in sentence.split("; ") if f"{device} (" in each)
        assert reason in part


def test_two_boards_are_for_a_person_to_choose_from() -> None:
    clock = ManualClock()
    computer = Computer(A=fake(clock), B=fake(clock))
    with pytest.raises(DeviceNotFound, match="2 roll encoders, on A and B: name one with the option port"):
        find_board(clock, open_port=computer.open, ports=usb("A", "B"))


def test_without_any_port_it_says_so() -> None:
    with pytest.raises(DeviceNotFound, match="no serial port"):
        find_board(ManualClock(), open_port=Computer().open, ports=[])


def test_a_board_that_runs_already_is_asked_at_once() -> None:
    clock = ManualClock()
    port = FakePort(FakeBoard(lambda t_ns: 0, start_ns=0), clock)
    clock.advance_ns(5_000_000_000)
    assert try_port("A", "", clock, open_port=port.open).identity is not None
    assert clock.now_ns() < 5_100_000_000


def test_a_silent_board_is_asked_only_after_the_boot_loader() -> None:
    clock = ManualClock()
    silent = Says(clock, b"")
    try_port("A", "", clock, open_port=lambda name: silent)
    assert silent.asked.count(b"id") == 3  # at 2.5, 3.0 and 3.5 s of the four seconds that it is given


def test_a_port_that_vanishes_is_no_board() -> None:
    clock = ManualClock()
    port = fake(clock)
    port.faults.unplugged = True
    assert "vanished" in try_port("A", "", clock, open_port=port.open).reason


def test_usb_ids_order_the_candidates(monkeypatch: pytest.MonkeyPatch) -> None:
    def port(device: str, vid: int | None, pid: int | None) -> SimpleNamespace:
        return SimpleNamespace(device=device, vid=vid, pid=pid, description="n/a")

    listed = [port("S0", None, None), port("X", 0x1234, 1), port("F", 0x0403, 0x6001), port("N", 0x2341, 0x43)]
    listed += [port("C", 0x1A86, 0x7523)]
    monkeypatch.setattr(encoder_ports.list_ports, "comports", lambda: listed)
    assert [each.device for each in candidates()] == ["C", "N", "F", "X", "S0"]
    assert [each.usb for each in candidates()] == [True, True, True, True, False]


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (serial.SerialException(errno.EBUSY, "busy"), "another program has it open"),
        (serial.SerialException("Could not exclusively lock port x: [Errno 11] ..."), "another program has it open"),
        (serial.SerialException(errno.ENOENT, "gone"), "there is no such port"),
        (serial.SerialException("odd"), r"cannot be opened \(odd\)"),
    ],
)
def test_why_a_port_cannot_be_opened(error: Exception, sentence: str) -> None:
    with pytest.raises(AssertionError, match=sentence):
        raise AssertionError(why_not_opened("x", error))


@posix_only
def test_no_permission_names_the_group_of_the_device() -> None:
    import grp

    group = grp.getgrgid(os.stat("/dev/null").st_gid).gr_name
    sentence = why_not_opened("/dev/null", serial.SerialException(errno.EACCES, "Permission denied"))
    assert f"join the group {group} (sudo usermod -aG {group} $USER)" in sentence
    assert "dialout" in why_not_opened("/dev/not-there", PermissionError(errno.EACCES, "no"))


@posix_only
def test_pyserial_on_a_pseudo_terminal() -> None:
    clock = MonotonicClock()
    board = FakeBoard(lambda t_ns: t_ns // 10_000_000, start_ns=clock.now_ns())
    with FakeTerminal(FakePort(board, clock), clock=clock) as terminal:
        encoder = SerialEncoder(example_rig(), clock=clock, options={"port": terminal.name})
        with encoder:
            with pytest.raises(DeviceNotFound, match="another program has it open"):
                SerialPort(terminal.name)
            encoder.set_zero(0)
            assert len([each for _ in range(60) if (each := encoder.read(0.1)) is not None]) == 60
            assert encoder.state is not None
            assert encoder.state.valid
            terminal.unplug()
            with pytest.raises(DeviceLost):
                list(iter(lambda: encoder.read(0.1), "never"))
    with pytest.raises(DeviceNotFound):
        SerialPort(terminal.name)


def test_the_encoder_searches_when_no_port_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = ManualClock()
    computer = Computer(A=Says(clock, b""), B=fake(clock))
    monkeypatch.setattr(encoder_serial, "candidates", lambda: usb("A", "B"))
    with SerialEncoder(example_rig(), clock=clock, options={"open_port": computer.open}) as encoder:
        assert encoder.port_name == "fake"
        assert encoder.read(0.1) is not None
