"""The self-signed certificate: what it holds, when it is kept, and when it is made anew."""

import datetime
import os
from pathlib import Path

import pytest
from cryptography import x509

from cathxr.core import ConfigError
from cathxr.wire.certificate import Certificate, ensured_certificate

NOW = datetime.datetime(2026, 3, 1, 12, tzinfo=datetime.UTC)


def _ensure(
    folder: Path, *, addresses: tuple[str, ...] = ("192.168.1.5",), days: float = 0, name: str = "lab.local"
) -> Certificate:
    return ensured_certificate(folder, names=(name,), addresses=addresses, now=NOW + datetime.timedelta(days=days))


def test_holds_every_name_and_address(tmp_path: Path) -> None:
    made = _ensure(tmp_path)
    certificate = x509.load_pem_x509_certificate(made.certificate_path.read_bytes())
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["localhost", "lab.local"]
    assert [str(each) for each in names.get_values_for_type(x509.IPAddress)] == ["127.0.0.1", "192.168.1.5"]
    assert not certificate.extensions.get_extension_for_class(x509.BasicConstraints).value.ca
    assert certificate.not_valid_after_utc - certificate.not_valid_before_utc == datetime.timedelta(days=397)
    assert len(made.fingerprint.split(":")) == 32


def test_is_kept_while_it_fits(tmp_path: Path) -> None:
    first = _ensure(tmp_path, addresses=("192.168.1.5", "10.0.0.2"))
    assert _ensure(tmp_path, days=380) == first
    assert _ensure(tmp_path, addresses=("10.0.0.2",)) == first  # more than is needed does no harm


@pytest.mark.parametrize(
    "change", [{"days": 391.0}, {"days": -1.0}, {"addresses": ("192.168.1.6",)}, {"name": "other.local"}]
)
def test_is_made_anew_when_it_no_longer_fits(tmp_path: Path, change: dict[str, object]) -> None:
    first = _ensure(tmp_path)
    second = _ensure(tmp_path, **change)  # type: ignore[arg-type]
    assert second.fingerprint != first.fingerprint


@pytest.mark.parametrize("name", ["certificate.pem", "key.pem"])
@pytest.mark.parametrize("content", [None, b"", b"-----BEGIN nonsense", b"\xff\xfe"])
def test_is_made_anew_when_a_file_is_damaged(tmp_path: Path, name: str, content: bytes | None) -> None:
    first = _ensure(tmp_path)
    if content is None:
        (tmp_path / name).unlink()
    else:
        (tmp_path / name).write_bytes(content)
    second = _ensure(tmp_path)
    assert second.fingerprint != first.fingerprint
    assert _ensure(tmp_path) == second


def test_a_key_of_another_certificate_is_not_used(tmp_path: Path) -> None:
    first = _ensure(tmp_path / "a")
    other = _ensure(tmp_path / "b")
    first.key_path.write_bytes(other.key_path.read_bytes())
    assert _ensure(tmp_path / "a").fingerprint not in (first.fingerprint, other.fingerprint)


@pytest.mark.skipif(os.name != "posix", reason="file modes are POSIX's")
def test_a_key_that_others_may_read_is_replaced(tmp_path: Path) -> None:
    first = _ensure(tmp_path / "config")
    assert first.key_path.stat().st_mode & 0o777 == 0o600
    assert (tmp_path / "config").stat().st_mode & 0o777 == 0o700
    first.key_path.chmod(0o644)
    second = _ensure(tmp_path / "config")
    assert second.fingerprint != first.fingerprint
    assert second.key_path.stat().st_mode & 0o777 == 0o600


def test_says_when_the_folder_cannot_be_written(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("", encoding="utf-8")
    with pytest.raises(ConfigError, match="Cannot write the certificate"):
        _ensure(blocked / "config")
