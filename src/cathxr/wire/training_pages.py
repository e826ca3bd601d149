"""Runs of training over HTTP: GET /training/runs/ID.json, from memory or made anew from the recording."""

import hashlib
import re
from collections.abc import Callable

from fastapi import APIRouter, Request
from starlette.responses import JSONResponse, Response

_ID = re.compile(r"[A-Za-z0-9-]{4,64}\Z")
_HEADERS = {"cache-control": "no-cache"}


def run_address(trial: str) -> str:
    """Return the path on the server of a trial's run."""
    return f"/training/runs/{trial}.json"


def make_runs_router(find: Callable[[str], bytes | None]) -> APIRouter:
    """Return the route. find: from a trial's id to its `RunPath` as JSON, None where there is none; may take a while.

    It is called in worker threads.
    """
    router = APIRouter()

    def run(request: Request, trial: str) -> Response:
        data = find(trial) if _ID.match(trial) else None
        if data is None:
            sentence = f"There is no run {trial[:40]!r}: it was not recorded here, or its recording is gone."
            return JSONResponse({"error": sentence}, status_code=404, headers={"cache-control": "no-store"})
        tag = f'"{hashlib.sha256(data).hexdigest()[:32]}"'
        if request.headers.get("if-none-match") == tag:
            return Response(status_code=304, headers=_HEADERS | {"etag": tag})
        return Response(data, media_type="application/json", headers=_HEADERS | {"etag": tag})

    router.add_api_route("/training/runs/{trial}.json", run, methods=["GET", "HEAD"], response_model=None)
    return router
