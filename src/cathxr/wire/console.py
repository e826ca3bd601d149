"""What a console shows about a running server: addresses, QR code, fingerprint, pairing code. Text only."""

import io

import segno

from cathxr.wire.server import LiveServer


def access_text(server: LiveServer, *, asked_port: int | None = None) -> str:
    """Return the lines that tell a person how to reach `server`, which has started.

    `asked_port`: the port that was asked for, so that another one in its place is mentioned.
    """
    lines = []
    if asked_port and asked_port != server.port:
        lines.append(f"Port {asked_port} is in use; this server took {server.port}.")
    lines.append(f"On this machine:  {server.url}")
    if server.lan_urls:
        lines += [f"On the network:   {url}" for url in server.lan_urls]
        lines += ["", qr_text(server.lan_urls[0]), ""]
        lines += [
            "The certificate is this server's own, so that the browser asks once whether to trust it. SHA-256:",
            *(f"  {row}" for row in _halves(server.fingerprint or "")),
        ]
    if server.pairing_code is not None:
        lines.append(f"Pairing code:     {server.pairing_code}  (a viewer who enters it may steer and command)")
    return "\n".join(lines)


def qr_text(text: str) -> str:
    """Return a QR code in block characters, for a console with light letters on a dark ground."""
    out = io.StringIO()
    segno.make(text, error="m", micro=False).terminal(out, compact=True, border=2)
    return out.getvalue().rstrip("\n")


def _halves(fingerprint: str) -> tuple[str, str]:
    middle = len(fingerprint) // 2 + 1
    return fingerprint[:middle].rstrip(":"), fingerprint[middle:]
