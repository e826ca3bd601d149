"""Slices of a CT and of its labels over HTTP, for those who have the key that only an operator is given."""

import hmac
from typing import Any, Protocol

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response

KEY_HEADER = "x-cathxr-key"
"""The key is no part of an address: addresses are kept, in histories and logs."""
_HEADERS = {"cache-control": "no-store"}  # nothing of a patient's CT stays on the disk of the machine with the page
_PLANES = ("axial", "coronal", "sagittal")


class SliceSource(Protocol):
    """Where slices come from. Called from worker threads."""

    def ct(self, plane: Any, index: int) -> bytes | None:
        """Return a slice's Hounsfield units, int16 little-endian, row by row; None where there is none."""
        ...

    def labels(self, version: int, plane: Any, index: int) -> bytes | None:
        """Return a slice's labels, uint8, row by row; None where there is none of that version."""
        ...


def make_slices_router(source: SliceSource, *, key: str) -> APIRouter:
    """Return the routes /heart/ct/{plane}/{index}.bin and /heart/labels/{version}/{plane}/{index}.bin."""
    router = APIRouter()

    def ct(request: Request, plane: str, index: int) -> Response:
        return _answer(request, key, lambda: source.ct(plane, index) if plane in _PLANES else None)

    def labels(request: Request, version: int, plane: str, index: int) -> Response:
        return _answer(request, key, lambda: source.labels(version, plane, index) if plane in _PLANES else None)

    router.add_api_route("/heart/ct/{plane}/{index:int}.bin", ct, methods=["GET"], response_model=None)
    router.add_api_route(
        "/heart/labels/{version:int}/{plane}/{index:int}.bin", labels, methods=["GET"], response_model=None
    )
    return router


def _answer(request: Request, key: str, ask: Any) -> Response:
    given = request.headers.get(KEY_HEADER, "")
    if not hmac.compare_digest(given.encode(), key.encode()):
        sentence = "The scan is shown to operators only: pair first, with the code that the server's console shows."
        return JSONResponse({"error": sentence}, status_code=403, headers=_HEADERS)
    data = ask()
    if data is None:
        return JSONResponse({"error": "There is no such slice."}, status_code=404, headers=_HEADERS)
    return Response(data, media_type="application/octet-stream", headers=_HEADERS)
