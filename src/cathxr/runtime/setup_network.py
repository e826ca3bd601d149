"""What a headset needs of this computer: an address, a certificate for it, and the link."""

import datetime

from cathxr.runtime.setup_nouns import SetupCheck


def network_checks(addresses: tuple[str, ...], *, lan: bool | None = None) -> tuple[SetupCheck, ...]:
    """Return address and certificate. lan: whether the running system serves the network; None: none is looked at."""
    if not addresses:
        network = SetupCheck(
            "network", "network", "warn", "no address", "connect to the network that the headset is in"
        )
    elif lan is False:
        then = "end this and start cathxr run --lan: only this computer is served now"
        network = SetupCheck("network", "network", "warn", ", ".join(addresses), then)
    else:
        then = "headset and computer in the same network"
        network = SetupCheck("network", "network", "good", ", ".join(addresses), then)
    return (network, _certificate(addresses))


def headset_check(headsets: int | None, *, lan: bool = True) -> SetupCheck:
    """Return whether a headset is connected. headsets: how many are; None: no live system runs here."""
    if headsets:
        return SetupCheck("headset", "headset", "good", f"{headsets} connected")
    if headsets is not None and lan:
        then = "open the address that the console shows in the headset's browser (docs/xr.md)"
        return SetupCheck("headset", "headset", "unknown", "none is connected", then)
    found = "no live system here" if headsets is None else "none is connected"
    then = "start cathxr run --lan, then open the address that it prints in the headset's browser (docs/xr.md)"
    return SetupCheck("headset", "headset", "unknown", found, then)


def _certificate(addresses: tuple[str, ...]) -> SetupCheck:
    from cryptography import x509

    from cathxr.wire.network import user_folder

    def made(verdict: str, found: str, then: str) -> SetupCheck:
        return SetupCheck("network", "certificate", "good" if verdict == "good" else "warn", found, then)

    path = user_folder() / "certificate.pem"
    try:
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except FileNotFoundError:
        return made("warn", "none yet", "cathxr run --lan makes it")
    except (OSError, ValueError, x509.ExtensionNotFound):
        return made("warn", f"{path} cannot be read", "delete it; cathxr run --lan makes it anew")
    known = {str(each) for each in names.get_values_for_type(x509.IPAddress)}
    until = certificate.not_valid_after_utc
    told = f"valid until {until:%Y-%m-%d}"
    if until < datetime.datetime.now(datetime.UTC):
        return made("warn", told, "cathxr run --lan makes a new one, which the headset has to accept once")
    if not set(addresses) <= known:
        then = "cathxr run --lan makes a new one, which the headset has to accept once"
        return made("warn", f"{told}, not for this network", then)
    return made("good", told, "the headset accepts it once, on its first visit")
