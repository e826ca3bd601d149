"""The network part of `cathxr doctor`: addresses, the certificate for https, and who is connected right now."""

import json
import urllib.error
import urllib.request

from cathxr.app.page_options import DEFAULT_PORT
from cathxr.runtime.setup_network import headset_check, network_checks
from cathxr.runtime.setup_nouns import SetupCheck

_PATIENCE_S = 1.0


def network_findings() -> list[SetupCheck]:
    """Return what a headset would need of this computer's network, and whether one is connected to a system here."""
    from cathxr.wire.network import lan_addresses

    return [*network_checks(lan_addresses()), headset_check(_headsets())]


def _headsets() -> int | None:
    """Return how many headsets a live system on this computer's usual port has; None where there is no such system."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{DEFAULT_PORT}/api/health", timeout=_PATIENCE_S) as answer:
            return int(json.load(answer)["headsets"])
    except (urllib.error.URLError, OSError, ValueError, KeyError, TypeError):
        return None
