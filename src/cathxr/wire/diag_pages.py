"""Takes what the page /diag has measured: checked, not too large, not too often, and handed on to be kept."""

import json
from collections import deque
from collections.abc import Callable

from fastapi import APIRouter, Request
from pydantic import ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.responses import JSONResponse, Response

from cathxr.core import CathxrError, Clock
from cathxr.wire.diag_messages import DiagReport

MAX_BYTES = 32 * 1024
"""How long a report may be: a real one has about 4 kB."""
PER_MINUTE = 12
"""Reports that are taken within a minute, from all devices."""

Save = Callable[[str, str], str]
"""Keeps a report's text under a name that begins with a kind of device; returns the file's name. Raises CathxrError."""


def make_diag_router(save: Save, *, clock: Clock) -> APIRouter:
    """Return the route `POST /diag`. It answers with {"file": name}, or with {"error": sentence}."""
    router = APIRouter()
    taken: deque[float] = deque(maxlen=PER_MINUTE)

    async def post(request: Request) -> Response:
        now_s = clock.now_ns() * 1e-9
        if len(taken) == PER_MINUTE and now_s - taken[0] < 60.0:
            return _refused(
                429, f"{PER_MINUTE} measurements were saved within a minute: wait a little, then try again."
            )
        kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
        if kind != "application/json":
            return _refused(415, "A measurement must come as JSON (content-type application/json).")
        body = await _body(request)
        if body is None:
            return _refused(413, f"A measurement may have {MAX_BYTES} bytes at most.")
        try:
            report = DiagReport.model_validate_json(body)
        except ValidationError as error:
            fault = error.errors(include_url=False, include_context=False, include_input=False)[0]
            where = ".".join(str(each) for each in fault["loc"])[:80]
            return _refused(422, f"This is no measurement that this server knows: {where}: {fault['msg'][:120]}.")
        taken.append(now_s)
        try:
            name = await run_in_threadpool(save, _kind(report), _text(report))
        except CathxrError as error:
            return _refused(507, str(error))
        return JSONResponse({"file": name}, status_code=201, headers={"cache-control": "no-store"})

    router.add_api_route("/diag", post, methods=["POST"], response_model=None)
    return router


async def _body(request: Request) -> bytes | None:
    """Return what was posted, None as soon as it is too long."""
    parts, length = [], 0
    async for part in request.stream():
        length += len(part)
        if length > MAX_BYTES:
            return None
        parts.append(part)
    return b"".join(parts)


def _kind(report: DiagReport) -> str:
    return "headset" if report.headset is not None or report.device.vr else "desktop"


def _text(report: DiagReport) -> str:
    return json.dumps(report.model_dump(by_alias=True), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _refused(status: int, sentence: str) -> Response:
    return JSONResponse({"error": sentence}, status_code=status, headers={"cache-control": "no-store"})
