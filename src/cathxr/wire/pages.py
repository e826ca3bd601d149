"""The HTTP side: the built page, the scene's files, camera pictures, pictures of results, and the API's answers."""

import hashlib
from collections.abc import Collection, Mapping
from pathlib import Path, PurePosixPath
from types import MappingProxyType
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import FileResponse, HTMLResponse, JSONResponse, Response

from cathxr.wire.hub import Hub
from cathxr.wire.messages import PROTOCOL, SceneDescription
from cathxr.wire.packed import Packed

PICTURE_WAIT_S = 1.0
"""How long a request for a picture that is not there yet waits."""
MAX_SEQ = 2**62

# Said here and not asked of the system: on Windows the registry may call JavaScript text/plain, which browsers refuse.
_TYPES: Mapping[str, str] = MappingProxyType(
    {
        ".html": "text/html; charset=utf-8",
        ".js": "text/javascript; charset=utf-8",
        ".css": "text/css; charset=utf-8",
        ".json": "application/json",
        ".webmanifest": "application/manifest+json",
        ".svg": "image/svg+xml",
        ".png": "image/png",
        ".jpg": "image/jpeg",
        ".ico": "image/x-icon",
        ".woff2": "font/woff2",
        ".txt": "text/plain; charset=utf-8",
        ".glb": "model/gltf-binary",
        ".bin": "application/octet-stream",
        ".wasm": "application/wasm",
    }
)
_PAGES: Mapping[str, str] = MappingProxyType({"": "index.html", "diag": "diag.html", "setup": "setup.html"})
"""Pages that have a shorter path than their file's name."""
_REVALIDATE = "no-cache"
_FOREVER = "public, max-age=31536000, immutable"
_NEVER = "no-store"

_NOT_BUILT = """<!doctype html><html lang="en"><meta charset="utf-8"><title>cathxr</title>
<h1>The server runs, but its page is not built.</h1>
<p>In a checkout of the project, run <code>pip install -e .</code> (or <code>make demo</code>), which builds it, and
load this address again. The link itself works: see docs/wire.md for <code>/ws</code>.</p></html>
"""


def make_router(
    hub: Hub,
    scene: SceneDescription,
    *,
    files: Mapping[str, Path | Packed],
    page: Path,
    software: str,
    cameras: Collection[str] = (),
) -> APIRouter:
    """Return the routes. `files`: paths under /scene/ and the files they stand for. `page`: the built page's folder.

    cameras: what else there are pictures of, besides the scene's cameras.

    Raises:
        ValueError: a path of `files` does not begin with /scene/.
    """
    for path in files:
        if not path.startswith("/scene/") or path == "/scene/scene.json":
            raise ValueError(f"files: expected paths under /scene/ other than scene.json, got {path!r}")
    router = APIRouter()
    scene_text = scene.model_dump_json().encode()
    scene_tag = f'"{hashlib.sha256(scene_text).hexdigest()[:32]}"'
    with_pictures = frozenset(camera.name for camera in scene.cameras) | frozenset(cameras)

    async def health(request: Request) -> Response:
        report = {
            "software": software,
            "protocol": PROTOCOL,
            "source": scene.source,
            "clients": hub.clients,
            "headsets": hub.people.headsets(),
            "session": hub.session.model_dump(),
            "health": hub.health(skipped=0).model_dump(),
        }
        return JSONResponse(report, headers={"cache-control": _NEVER})

    async def scene_json(request: Request) -> Response:
        headers = {"etag": scene_tag, "cache-control": _REVALIDATE}
        if _unchanged(request, scene_tag):
            return Response(status_code=304, headers=headers)
        return Response(scene_text, media_type="application/json", headers=headers)

    async def scene_file(request: Request, path: str) -> Response:
        file = files.get(f"/scene/{path}")
        if file is None:
            return _missing(f"The scene has no file {path[:80]!r}: scene.json names those it has.")
        if isinstance(file, Packed):
            return _packed_response(request, file)
        return _file_response(request, file, cache=_REVALIDATE)

    async def picture(request: Request, camera: str) -> Response:
        return await _picture(request, hub, camera, with_pictures)

    async def result(request: Request, name: str) -> Response:
        return _result(request, hub, name)

    async def unknown(request: Request, path: str) -> Response:
        return _missing(f"The API has no {path[:80]!r}: see docs/wire.md for what there is.")

    async def static(request: Request, path: str) -> Response:
        return _static(request, page, _PAGES.get(path, path))

    for path, endpoint in (
        ("/api/health", health),
        ("/api/{path:path}", unknown),
        ("/scene/scene.json", scene_json),
        ("/scene/{path:path}", scene_file),
        ("/cameras/{camera}.jpg", picture),
        ("/calibration/{name}.png", result),
        ("/{path:path}", static),
    ):
        router.add_api_route(path, endpoint, methods=["GET", "HEAD"], response_model=None)
    return router


async def _picture(request: Request, hub: Hub, camera: str, cameras: Collection[str]) -> Response:
    """Answer with the camera's newest picture after ?after=SEQ (default: any), at most ?width= wide; 204 for none."""
    if camera not in cameras:
        return _missing(f"There is no camera {camera[:40]!r}: there are {', '.join(sorted(cameras))}.")
    after = _whole_number(request.query_params.get("after", "-1"), least=-1, most=MAX_SEQ)
    width_text = request.query_params.get("width")
    width = None if width_text is None else _whole_number(width_text, least=1, most=16384)
    if after is None or (width is None and width_text is not None):
        sentence = "after must be a whole number from -1 on, and width one from 1 to 16384."
        return JSONResponse({"error": sentence}, status_code=400, headers={"cache-control": _NEVER})
    found = await hub.pictures.newer(camera, after=after, timeout_s=PICTURE_WAIT_S)
    data = None if found is None else await hub.pictures.jpeg(found, width_px=width)
    if found is None or data is None:
        return Response(status_code=204, headers={"cache-control": _NEVER})
    headers = {"cache-control": _NEVER, "x-cathxr-seq": str(found.seq), "x-cathxr-t": f"{found.t_s:.6f}"}
    return Response(data, media_type="image/jpeg", headers=headers)


def _result(request: Request, hub: Hub, name: str) -> Response:
    """Answer with a picture of a result; it changes under its name, which the tag tells."""
    found = hub.results.get(name)
    if found is None:
        return _missing(f"There is no picture of a result named {name[:40]!r}: the calibration's state names them.")
    data, tag = found
    headers = {"etag": tag, "cache-control": _REVALIDATE}
    if _unchanged(request, tag):
        return Response(status_code=304, headers=headers)
    return Response(data, media_type="image/png", headers=headers)


def _static(request: Request, page: Path, path: str) -> Response:
    file = _inside(page, path)
    if file is None:
        if path == "index.html":
            return HTMLResponse(_NOT_BUILT, status_code=503, headers={"cache-control": _NEVER})
        return Response(f"There is no {path[:80]!r} here.\n", 404, {"cache-control": _NEVER}, "text/plain")
    # Vite puts a hash of the content into the names under assets/.
    return _file_response(request, file, cache=_FOREVER if path.startswith("assets/") else _REVALIDATE)


def _inside(folder: Path, path: str) -> Path | None:
    """Return the file that `path` names inside `folder`, None when there is none or it would lie outside."""
    parts = PurePosixPath(path).parts
    # Colons and backslashes mean drives, streams and folders on Windows; a leading dot hides files.
    if any(each.startswith((".", "/")) or set(each) & set("\\:\0") for each in parts):
        return None
    file = folder.joinpath(*parts)
    try:
        return file if file.is_file() and file.resolve().is_relative_to(folder.resolve()) else None
    except (OSError, ValueError):
        return None  # a name that the system cannot have


def _file_response(request: Request, file: Path, *, cache: str) -> Response:
    try:
        status = file.stat()
    except OSError:
        return _missing(f"The file {file.name} has gone from the server's disk.")
    kind = _TYPES.get(file.suffix.lower(), "application/octet-stream")
    response = FileResponse(file, media_type=kind, stat_result=status, headers={"cache-control": cache})
    if _unchanged(request, response.headers["etag"]):
        return Response(status_code=304, headers={"etag": response.headers["etag"], "cache-control": cache})
    return response


def _packed_response(request: Request, file: Packed) -> Response:
    """Answer with a file from memory, as gzip where the client takes it."""
    headers = {"etag": file.tag, "cache-control": _REVALIDATE, "vary": "accept-encoding"}
    if _unchanged(request, file.tag):
        return Response(status_code=304, headers=headers)
    taken = [each.partition(";")[0].strip().lower() for each in request.headers.get("accept-encoding", "").split(",")]
    if "gzip" in taken:
        return Response(file.data, media_type=_TYPES[".bin"], headers=headers | {"content-encoding": "gzip"})
    return Response(file.unpacked, media_type=_TYPES[".bin"], headers=headers)


def _unchanged(request: Request, tag: str) -> bool:
    """Return whether the client holds this version already."""
    held = [each.strip().removeprefix("W/") for each in request.headers.get("if-none-match", "").split(",")]
    return tag in held


def _missing(sentence: str) -> Response:
    body: dict[str, Any] = {"error": sentence}
    return JSONResponse(body, status_code=404, headers={"cache-control": _NEVER})


def _whole_number(text: str, *, least: int, most: int) -> int | None:
    if not text.removeprefix("-").isdecimal() or len(text) > 20:
        return None
    value = int(text)
    return value if least <= value <= most else None
