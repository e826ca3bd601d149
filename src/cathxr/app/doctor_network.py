"""The network part of `cathxr doctor`: addresses, the certificate for https, and who is connected right now."""

import datetime
import json
import urllib.error
import urllib.request

from cathxr.app.doctor_findings import Finding
from cathxr.app.page_options import DEFAULT_PORT

_PATIENCE_S = 1.0


def network_findings() -> list[Finding]:
    """Return what a headset would need of this computer's network, and whether a live system answers here."""
    from cathxr.wire.network import lan_addresses

    addresses = lan_addresses()
    if addresses:
        network = Finding("network", "good", ", ".join(addresses), "headset and computer in the same network")
    else:
        network = Finding("network", "missing", "no address", "connect to the network that the headset is in")
    return [network, _certificate(addresses), _live()]


def _certificate(addresses: tuple[str, ...]) -> Finding:
    from cryptography import x509

    from cathxr.wire.network import user_folder

    path = user_folder() / "certificate.pem"
    try:
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
    except FileNotFoundError:
        return Finding("certificate", "missing", "none yet", "cathxr run --lan makes it")
    except (OSError, ValueError):
        return Finding("certificate", "missing", f"{path} cannot be read", "delete it; cathxr run --lan makes it anew")
    names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    known = {str(each) for each in names.get_values_for_type(x509.IPAddress)}
    until = certificate.not_valid_after_utc
    told = f"valid until {until:%Y-%m-%d}"
    if until < datetime.datetime.now(datetime.UTC) or not set(addresses) <= known:
        then = "cathxr run --lan makes a new one, which the headset has to accept once"
        return Finding("certificate", "missing", f"{told}, not for this network", then)
    return Finding("certificate", "good", told, "the headset accepts it once, on its first visit")


def _live() -> Finding:
    """Return whether a live system answers on this computer's usual port, and that it is this program."""
    address = f"http://127.0.0.1:{DEFAULT_PORT}/scene/scene.json"
    then = "open the address that cathxr run --lan prints in the headset's browser; the page lists who is connected"
    try:
        with urllib.request.urlopen(address, timeout=_PATIENCE_S) as answer:
            json.load(answer)
    except (urllib.error.URLError, OSError, ValueError):
        return Finding("headset", "missing", "no live system here", f"start cathxr run --lan, then {then}")
    return Finding("headset", "missing", "a live system runs here", then)
