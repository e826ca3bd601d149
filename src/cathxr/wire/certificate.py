"""The self-signed certificate for https on the local network: made once, kept, made anew when it no longer fits."""

import contextlib
import datetime
import ipaddress
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from cathxr.core import ConfigError

LIFETIME = datetime.timedelta(days=397)
"""The longest that browsers take."""
RENEW_BEFORE = datetime.timedelta(days=7)
_CLOCK_SLACK = datetime.timedelta(hours=1)
"""How far behind a headset's clock may be."""


@dataclass(frozen=True)
class Certificate:
    """Where certificate and key lie, and the certificate's SHA-256 fingerprint as AA:BB:..."""

    certificate_path: Path
    key_path: Path
    fingerprint: str


def ensured_certificate(
    folder: Path, *, names: Sequence[str], addresses: Sequence[str], now: datetime.datetime
) -> Certificate:
    """Return the certificate in `folder` for these names and addresses, made anew unless the one there still fits.

    `names`, `addresses`: what it must be valid for, besides localhost and 127.0.0.1. `now`: with a time zone.

    Raises:
        ConfigError: the folder cannot be written.
    """
    certificate_path, key_path = folder / "certificate.pem", folder / "key.pem"
    wanted_names = tuple(dict.fromkeys(("localhost", *names)))
    wanted_addresses = tuple(dict.fromkeys(("127.0.0.1", *addresses)))
    certificate = _fitting(certificate_path, key_path, wanted_names, wanted_addresses, now)
    if certificate is None:
        key = ec.generate_private_key(ec.SECP256R1())
        certificate = _signed(key, wanted_names, wanted_addresses, now)
        key_text = key.private_bytes(
            serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
        )
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            _write(key_path, key_text, mode=0o600)
            _write(certificate_path, certificate.public_bytes(serialization.Encoding.PEM), mode=0o644)
        except OSError as error:
            raise ConfigError(
                f"Cannot write the certificate for https into {folder}: {error.strerror}; make the folder writable."
            ) from error
    fingerprint = certificate.fingerprint(hashes.SHA256()).hex(":").upper()
    return Certificate(certificate_path, key_path, fingerprint)


def _fitting(
    certificate_path: Path,
    key_path: Path,
    names: Sequence[str],
    addresses: Sequence[str],
    now: datetime.datetime,
) -> x509.Certificate | None:
    """Return the stored certificate when it can be used, else None."""
    try:
        certificate = x509.load_pem_x509_certificate(certificate_path.read_bytes())
        key = serialization.load_pem_private_key(key_path.read_bytes(), password=None)
        alternatives = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (OSError, ValueError, TypeError, x509.ExtensionNotFound):
        return None  # missing or damaged: a new one costs nothing but the headset's question
    valid = certificate.not_valid_before_utc <= now <= certificate.not_valid_after_utc - RENEW_BEFORE
    stored_names = set(alternatives.get_values_for_type(x509.DNSName))
    stored_addresses = {str(each) for each in alternatives.get_values_for_type(x509.IPAddress)}
    fits = stored_names >= set(names) and stored_addresses >= set(addresses)
    if not (valid and fits and key.public_key() == certificate.public_key()):
        return None
    if os.name == "posix" and key_path.stat().st_mode & 0o077:
        return None  # someone else may have read the key
    return certificate


def _signed(
    key: ec.EllipticCurvePrivateKey, names: Sequence[str], addresses: Sequence[str], now: datetime.datetime
) -> x509.Certificate:
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "cathxr")])
    alternatives: list[x509.GeneralName] = [x509.DNSName(name) for name in names]
    alternatives += [x509.IPAddress(ipaddress.ip_address(address)) for address in addresses]
    usage = x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=False,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )
    start = now - _CLOCK_SLACK
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(start)
        .not_valid_after(start + LIFETIME)
        .add_extension(x509.SubjectAlternativeName(alternatives), critical=False)
        # Not an authority: whoever installs it in a headset trusts this server, and nothing that its key could sign.
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )


def _write(path: Path, content: bytes, *, mode: int) -> None:
    """Write a file that has its mode from the first byte on, and is never half there."""
    part = path.with_name(path.name + ".part")
    with contextlib.suppress(FileNotFoundError):
        part.unlink()
    descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode)
    with os.fdopen(descriptor, "wb") as file:
        file.write(content)
    part.replace(path)
