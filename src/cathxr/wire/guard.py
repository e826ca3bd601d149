"""What stands before every request: the check of Host and Origin, and the headers that every answer carries.

A page of another origin, or a name that someone points at this machine (DNS rebinding), must not reach the link: on
loopback every client is an operator.
"""

import ipaddress
import json
from collections.abc import Collection

from starlette.types import ASGIApp, Message, Receive, Scope, Send

LOOPBACK_NAMES = frozenset({"localhost", "127.0.0.1", "::1"})


def host_name(host: str) -> str:
    """Return the name in a Host header, without its port, brackets and final dot, in lower case."""
    name = host.strip().lower()
    if name.startswith("["):
        return name[1:].partition("]")[0]
    return name.partition(":")[0].rstrip(".")


def is_loopback(address: str) -> bool:
    """Return whether a peer's address is this machine's own loopback."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:
        return False
    mapped = parsed.ipv4_mapped if isinstance(parsed, ipaddress.IPv6Address) else None
    return (mapped or parsed).is_loopback


class Guard:
    """An ASGI application around another: refuses foreign Hosts and Origins with 403, and adds security headers.

    `names`: what this server may be called. `scheme`: http or https, as the browser sees it.
    """

    def __init__(self, app: ASGIApp, *, names: Collection[str], scheme: str) -> None:
        self._app = app
        self._names = frozenset(name.lower() for name in names)
        self._scheme = scheme

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one connection."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        hosts = [value.decode("latin-1") for name, value in scope["headers"] if name == b"host"]
        origins = [value.decode("latin-1") for name, value in scope["headers"] if name == b"origin"]
        fault = self._fault(scope, hosts, origins)
        if fault is not None:
            await _refuse(scope, send, fault)
            return

        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                message = {**message, "headers": [*message["headers"], *self._headers(hosts[0])]}
            await send(message)

        await self._app(scope, receive, send_with_headers)

    def _fault(self, scope: Scope, hosts: list[str], origins: list[str]) -> str | None:
        """Return why a request is refused, None when it is not."""
        own_address = (scope.get("server") or ("",))[0]
        # The address that the connection came in at is this machine's own, whatever the list of names knows.
        if len(hosts) != 1 or host_name(hosts[0]) not in self._names | {own_address}:
            return "This server does not go by the name in the Host header: open the address that its console shows."
        if any(origin.lower() != f"{self._scheme}://{hosts[0].strip().lower()}" for origin in origins):
            return "A page of another origin may not use this server: open the address that its console shows."
        return None

    def _headers(self, host: str) -> list[tuple[bytes, bytes]]:
        link = ("wss://" if self._scheme == "https" else "ws://") + host.strip()
        policy = (
            "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; "
            f"font-src 'self' data:; connect-src 'self' blob: {link}; worker-src 'self' blob:; "
            "object-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        )
        return [
            (b"content-security-policy", policy.encode("latin-1")),
            (b"x-content-type-options", b"nosniff"),
            (b"referrer-policy", b"no-referrer"),
            (b"cross-origin-resource-policy", b"same-origin"),
            (b"cross-origin-opener-policy", b"same-origin"),
        ]


async def _refuse(scope: Scope, send: Send, sentence: str) -> None:
    kind = "http.response" if scope["type"] == "http" else "websocket.http.response"
    body = json.dumps({"error": sentence}).encode()
    headers = [
        (b"content-type", b"application/json"),
        (b"content-length", str(len(body)).encode()),
        (b"x-content-type-options", b"nosniff"),
        (b"cache-control", b"no-store"),
    ]
    await send({"type": f"{kind}.start", "status": 403, "headers": headers})
    await send({"type": f"{kind}.body", "body": body})
