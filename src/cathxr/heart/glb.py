"""Reads and writes binary glTF 2.0 (GLB): one named, coloured mesh per structure, and nothing a plain loader lacks.

A mesh's first primitive is the structure's walls. Where the structure meets other blood or a vessel was cut, a second
one with the material `caps` closes it: both together are watertight, and a client may leave the caps out.

Only core glTF is written (float32 positions and normals, uint16 or uint32 indices), so that any client reads it.
glTF's frame: metres, y up; `gltf = (x, z, -y) / 1000` of `ct` (LPS, mm): y is superior, z anterior, x patient left.
Source: Khronos glTF 2.0 specification, sections 3.6 (buffers), 3.7 (geometry) and 4.4 (GLB layout).
"""

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cathxr.core import DataError, FloatArray
from cathxr.core.arrays import checked

_MAGIC, _VERSION, _JSON, _BIN = 0x46546C67, 2, 0x4E4F534A, 0x004E4942
_HEADER_BYTES, _CHUNK_HEADER_BYTES = 12, 8
_FLOAT, _UINT16, _UINT32 = 5126, 5123, 5125
_ARRAY_BUFFER, _ELEMENT_BUFFER = 34962, 34963
_INDEX_TYPES: dict[int, np.dtype[Any]] = {_UINT16: np.dtype("<u2"), _UINT32: np.dtype("<u4")}


CAPS = "caps"
"""The name of the material of every structure's caps."""
_CAPS_COLOUR, _CAPS_OPACITY = "#c9ccd2", 0.2


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles in `ct`.

    vertices_mm (N, 3) mm; normals (N, 3) unit, outward; triangles (M, 3) indices, counter-clockwise from outside.
    """

    vertices_mm: FloatArray
    normals: FloatArray
    triangles: NDArray[np.int64]

    def __post_init__(self) -> None:
        _check(self)


@dataclass(frozen=True, eq=False)
class Part:
    """One named surface in `ct`: its walls, and the caps that close them, which share no vertices with them.

    vertices_mm, normals, triangles: as in `Patch`, of the walls. colour: "#rrggbb" in sRGB. opacity: 0 to 1.
    caps: None where the walls are closed, or where what is open stays open.
    """

    node: str
    vertices_mm: FloatArray
    normals: FloatArray
    triangles: NDArray[np.int64]
    colour: str
    opacity: float = 1.0
    caps: Patch | None = None

    def __post_init__(self) -> None:
        _check(self)


def _check(patch: Patch | Part) -> None:
    """Make the arrays of a patch read-only, each of the shape that it should have."""
    object.__setattr__(patch, "vertices_mm", checked("vertices_mm", patch.vertices_mm, (None, 3)))
    object.__setattr__(patch, "normals", checked("normals", patch.normals, (len(patch.vertices_mm), 3)))
    triangles = np.array(patch.triangles, dtype=np.int64)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not triangles.size:
        raise ValueError(f"triangles: expected shape (M, 3), got {triangles.shape}")
    if triangles.min() < 0 or triangles.max() >= len(patch.vertices_mm):
        raise ValueError(f"triangles: expected indices from 0 to {len(patch.vertices_mm) - 1}")
    triangles.setflags(write=False)
    object.__setattr__(patch, "triangles", triangles)


def gltf_from_ct(points_mm: FloatArray) -> FloatArray:
    """Return points (..., 3) of `ct` (LPS, mm) in glTF's frame (metres, y up)."""
    points = np.asarray(points_mm, dtype=np.float64)
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1) / 1000.0


def ct_from_gltf(points_m: FloatArray) -> FloatArray:
    """Return points (..., 3) of glTF's frame (metres, y up) in `ct` (LPS, mm)."""
    points = np.asarray(points_m, dtype=np.float64)
    return np.stack([points[..., 0], -points[..., 2], points[..., 1]], axis=-1) * 1000.0


def encode_glb(parts: Sequence[Part], copyright_text: str, generator: str) -> bytes:
    """Return a GLB file's bytes with one node, mesh and material for each part; the same input gives the same bytes.

    Raises:
        ValueError: no parts, or two with the same node name.
    """
    names = [part.node for part in parts]
    if not names or len(set(names)) != len(names):
        raise ValueError(f"parts: expected at least one part and different node names, got {names}")
    buffer = _Buffer()
    materials = [_material(part.node, part.colour, part.opacity) for part in parts]
    if any(part.caps is not None for part in parts):
        materials.append(_material(CAPS, _CAPS_COLOUR, _CAPS_OPACITY))
    meshes = [_mesh(buffer, part, index, len(parts)) for index, part in enumerate(parts)]
    document = {
        "asset": {"version": "2.0", "generator": generator, "copyright": copyright_text},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(parts)))}],
        "nodes": [{"name": part.node, "mesh": index} for index, part in enumerate(parts)],
        "meshes": meshes,
        "materials": materials,
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False).encode()
    text += b" " * (-len(text) % 4)
    total = _HEADER_BYTES + 2 * _CHUNK_HEADER_BYTES + len(text) + len(buffer.data)
    return b"".join(
        [
            struct.pack("<III", _MAGIC, _VERSION, total),
            struct.pack("<II", len(text), _JSON),
            text,
            struct.pack("<II", len(buffer.data), _BIN),
            bytes(buffer.data),
        ]
    )


def read_glb(path: Path) -> tuple[dict[str, Any], bytes]:
    """Return the JSON document and the binary chunk of a GLB file.

    Raises:
        DataError: the file is missing, is not GLB 2.0, or is cut short.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error.strerror}); give a heart folder that holds it.") from error
    if len(data) < _HEADER_BYTES + _CHUNK_HEADER_BYTES:
        raise DataError(f"{path} is {len(data)} bytes long, too short for a GLB file; build the heart again.")
    magic, version, total = struct.unpack_from("<III", data, 0)
    if magic != _MAGIC:
        raise DataError(f"{path} is not a GLB file (it does not begin with 'glTF'); build the heart again.")
    if version != _VERSION:
        raise DataError(f"{path} is glTF version {version}; only version 2 is read. Export it as glTF 2.0.")
    if total != len(data):
        raise DataError(f"{path} should be {total} bytes long and is {len(data)}; copy it again.")
    chunks = _chunks(path, data)
    try:
        document = json.loads(chunks[_JSON].decode())
    except (KeyError, ValueError) as error:
        raise DataError(f"{path} holds no readable JSON chunk; build the heart again.") from error
    if not isinstance(document, dict):
        raise DataError(f"{path} holds a JSON chunk that is not an object; build the heart again.")
    return document, chunks.get(_BIN, b"")


def node_names(document: dict[str, Any], path: Path) -> tuple[str, ...]:
    """Return the names of the nodes that carry a mesh, in file order; `path` is named where they cannot be read.

    Raises:
        DataError: the document's list of nodes is not what glTF says.
    """
    nodes = document.get("nodes", [])
    if not isinstance(nodes, list) or not all(isinstance(node, dict) for node in nodes):
        raise DataError(f"{path} has a list of nodes that is not glTF's; build the heart again.")
    return tuple(str(node.get("name", "")) for node in nodes if "mesh" in node)


def surface(
    document: dict[str, Any], binary: bytes, node: str, *, with_caps: bool = False
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return a node's vertices (N, 3) mm in `ct` and triangles (M, 3), as `encode_glb` wrote them.

    with_caps: whether to append the caps, if there are any; their vertices on the rim repeat the walls'.

    Raises:
        DataError: no such node, or its accessors do not fit the binary chunk.
    """
    try:
        index = next(each["mesh"] for each in document["nodes"] if each.get("name") == node)
        primitives = document["meshes"][index]["primitives"]
        chosen = primitives[: 2 if with_caps else 1]
        positions = [_accessor(document, binary, each["attributes"]["POSITION"], 3) for each in chosen]
        triangles = [_accessor(document, binary, each["indices"], 1).astype(np.int64) for each in chosen]
        starts = np.cumsum([0, *(len(each) for each in positions[:-1])])
        corners = np.concatenate([each + start for each, start in zip(triangles, starts, strict=True)])
    except StopIteration as error:
        raise DataError(f"The GLB file has no node named {node!r}; build the heart again.") from error
    except (KeyError, IndexError, TypeError, ValueError) as error:
        raise DataError(f"The GLB file's node {node!r} cannot be read ({error}); build the heart again.") from error
    return ct_from_gltf(np.concatenate(positions).astype(np.float64)), corners.reshape(-1, 3)


def _chunks(path: Path, data: bytes) -> dict[int, bytes]:
    """Return the chunks by type."""
    chunks: dict[int, bytes] = {}
    at = _HEADER_BYTES
    while at + _CHUNK_HEADER_BYTES <= len(data):
        length, kind = struct.unpack_from("<II", data, at)
        at += _CHUNK_HEADER_BYTES
        if at + length > len(data):
            raise DataError(f"{path} has a chunk that runs past the end of the file; copy it again.")
        chunks.setdefault(kind, data[at : at + length])
        at += length
    return chunks


def _accessor(document: dict[str, Any], binary: bytes, index: int, width: int) -> NDArray[Any]:
    """Return an accessor's values (count,) or (count, width); tightly packed views only."""
    accessor = document["accessors"][index]
    view = document["bufferViews"][accessor["bufferView"]]
    component = accessor["componentType"]
    kind: np.dtype[Any] = np.dtype("<f4") if component == _FLOAT else _INDEX_TYPES[component]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    values: NDArray[Any] = np.frombuffer(binary, dtype=kind, count=accessor["count"] * width, offset=start)
    return values.reshape(-1, width) if width > 1 else values


class _Buffer:
    """Collects arrays into one binary chunk with its views and accessors."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: NDArray[Any], component: int, kind: str, target: int, bounds: bool = False) -> int:
        """Return the index of the accessor made for `values`."""
        raw = np.ascontiguousarray(values).tobytes()
        self.views.append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw), "target": target})
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": component,
            "count": len(values),
            "type": kind,
        }
        if bounds:
            accessor["min"] = [float(each) for each in values.min(axis=0)]
            accessor["max"] = [float(each) for each in values.max(axis=0)]
        self.data += raw + b"\0" * (-len(raw) % 4)
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _mesh(buffer: _Buffer, part: Part, material: int, caps_material: int) -> dict[str, Any]:
    """Return a glTF mesh for one part, its arrays put into `buffer`."""
    primitives = [_primitive(buffer, part, material)]
    if part.caps is not None:
        primitives.append(_primitive(buffer, part.caps, caps_material))
    return {"name": part.node, "primitives": primitives}


def _primitive(buffer: _Buffer, patch: Patch | Part, material: int) -> dict[str, Any]:
    """Return a glTF primitive, its arrays put into `buffer`."""
    positions = gltf_from_ct(patch.vertices_mm).astype("<f4")
    normals = (gltf_from_ct(patch.normals) * 1000.0).astype("<f4")
    component = _UINT16 if len(positions) < 0xFFFF else _UINT32
    triangles = patch.triangles.reshape(-1).astype(_INDEX_TYPES[component])
    attributes = {
        "POSITION": buffer.add(positions, _FLOAT, "VEC3", _ARRAY_BUFFER, bounds=True),
        "NORMAL": buffer.add(normals, _FLOAT, "VEC3", _ARRAY_BUFFER),
    }
    indices = buffer.add(triangles, component, "SCALAR", _ELEMENT_BUFFER)
    return {"attributes": attributes, "indices": indices, "material": material}


def _material(name: str, colour: str, opacity: float) -> dict[str, Any]:
    """Return a glTF material: a colour, linear as glTF wants it, matt, seen from both sides."""
    srgb = np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255.0
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    factor = [round(float(each), 6) for each in linear] + [opacity]
    return {
        "name": name,
        "pbrMetallicRoughness": {"baseColorFactor": factor, "metallicFactor": 0.0, "roughnessFactor": 0.6},
        "alphaMode": "OPAQUE" if opacity >= 1.0 else "BLEND",
        "doubleSided": True,
    }
