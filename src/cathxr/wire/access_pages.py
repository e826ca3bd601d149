"""How else this server can be reached: its addresses as JSON, and each as a QR code for a headset to read."""

import io
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import lru_cache

import segno
from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response


@dataclass(frozen=True)
class Access:
    """Where the page is.

    local: on this machine. port: there. network: from other machines, the most useful first; empty where the network is
    not served. fingerprint: of the certificate, SHA-256. has_code: whether a pairing code is on the server's console.
    """

    local: str
    port: int
    network: tuple[str, ...]
    fingerprint: str | None
    has_code: bool


def make_access_router(access: Callable[[], Access]) -> APIRouter:
    """Return the routes /api/access and /qr.svg?address=…, which takes the server's own addresses and no others."""
    router = APIRouter()
    headers = {"cache-control": "no-store"}

    async def told(request: Request) -> Response:
        return JSONResponse(asdict(access()), headers=headers)

    async def code(request: Request) -> Response:
        asked = request.query_params.get("address", "")
        known = access()
        if asked not in (known.local, *known.network):
            sentence = "A QR code is made of this server's own addresses only: /api/access names them."
            return JSONResponse({"error": sentence}, status_code=404, headers=headers)
        return Response(qr_svg(asked), media_type="image/svg+xml", headers=headers)

    router.add_api_route("/api/access", told, methods=["GET", "HEAD"], response_model=None)
    router.add_api_route("/qr.svg", code, methods=["GET", "HEAD"], response_model=None)
    return router


@lru_cache(maxsize=32)
def qr_svg(text: str) -> bytes:
    """Return a QR code as SVG, black on white with the quiet zone that readers need."""
    out = io.BytesIO()
    segno.make(text, error="m", micro=False).save(
        out,
        kind="svg",
        border=4,
        dark="#000",
        light="#fff",
        xmldecl=False,
        omitsize=True,
        svgclass=None,
        lineclass=None,
    )
    return out.getvalue()
