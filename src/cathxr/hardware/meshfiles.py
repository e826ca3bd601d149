"""Meshes as files: STL and 3MF for a printer, GLB for a viewer. mm, but metres with y up in GLB, as glTF asks."""

import io
import json
import struct
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.meshes import TriangleMesh

_GLTF_FROM_BOX = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
_CONTENT_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)
_WHEN = (2000, 1, 1, 0, 0, 0)
"""Every entry's date, so that equal parts give equal files."""


@dataclass(frozen=True, eq=False)
class Node:
    """One placed mesh in a GLB. columns (3, 3), origin (3,): as of `Place`, mm in `box`; group: its parent's name."""

    name: str
    mesh: str
    columns: FloatArray
    origin: FloatArray
    group: str


def printable(mesh: TriangleMesh, up: Sequence[float]) -> TriangleMesh:
    """Return a mesh turned so that `up` points up, standing on z = 0 in the middle."""
    z = np.array(up) / np.linalg.norm(up)
    x = np.array([1.0, 0.0, 0.0]) if abs(z[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
    x = x - (x @ z) * z
    x = x / np.linalg.norm(x)
    turned = mesh.vertices @ np.column_stack([x, np.cross(z, x), z])
    low, high = turned.min(axis=0), turned.max(axis=0)
    return TriangleMesh(turned - [*(0.5 * (low + high)[:2]), low[2]], mesh.faces)


def stl_bytes(mesh: TriangleMesh, title: str) -> bytes:
    """Return a binary STL."""
    triangles = mesh.triangles
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    record = np.zeros(len(triangles), dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
    record["normal"], record["corners"] = normals, triangles
    head = title.encode("ascii", "replace")[:80].ljust(80)
    return head + struct.pack("<I", len(triangles)) + record.tobytes()


def threemf_bytes(mesh: TriangleMesh, title: str) -> bytes:
    """Return a 3MF with one object, in mm."""
    vertices = "".join(f'<vertex x="{x:.5f}" y="{y:.5f}" z="{z:.5f}"/>' for x, y, z in mesh.vertices.tolist())
    triangles = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in mesh.faces.tolist())
    model = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<model unit="millimeter" xml:lang="en" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f'<metadata name="Title">{escape(title)}</metadata><resources><object id="1" type="model" '
        f'name="{escape(title)}"><mesh><vertices>{vertices}</vertices><triangles>{triangles}</triangles></mesh>'
        '</object></resources><build><item objectid="1"/></build></model>'
    )
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive:
        for name, text in (
            ("[Content_Types].xml", _CONTENT_TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", model),
        ):
            archive.writestr(zipfile.ZipInfo(name, _WHEN), text, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def glb_bytes(
    meshes: dict[str, TriangleMesh], colours: dict[str, tuple[float, float, float]], nodes: Sequence[Node]
) -> bytes:
    """Return a GLB: each mesh once, a node for each place, the groups as their parents. Flat shaded."""
    chunks: list[bytes] = []
    views: list[dict[str, int]] = []
    accessors: list[dict[str, object]] = []
    listed, materials = [], []
    index_of = {key: index for index, key in enumerate(meshes)}
    for index, (key, mesh) in enumerate(meshes.items()):
        points = (mesh.triangles.reshape(-1, 3) @ _GLTF_FROM_BOX.T * 1e-3).astype("<f4")
        offset = sum(len(each) for each in chunks)
        chunks.append(points.tobytes())
        views.append({"buffer": 0, "byteOffset": offset, "byteLength": len(chunks[-1]), "target": 34962})
        accessors.append({"bufferView": index, "componentType": 5126, "count": len(points), "type": "VEC3",
                          "min": points.min(axis=0).tolist(), "max": points.max(axis=0).tolist()})  # fmt: skip
        listed.append({"name": key, "primitives": [{"attributes": {"POSITION": index}, "material": index}]})
        # sRGB as people choose it; glTF wants linear light.
        base = [float(part**2.2) for part in colours[key]]
        materials.append({"pbrMetallicRoughness": {"baseColorFactor": [*base, 1.0], "metallicFactor": 0.0,
                                                   "roughnessFactor": 0.8}, "doubleSided": False})  # fmt: skip
    groups = sorted({each.group for each in nodes})
    placed = [_gltf_node(each, index_of[each.mesh]) for each in nodes]
    parents = [
        {"name": group, "children": [index for index, each in enumerate(nodes) if each.group == group]}
        for group in groups
    ]
    binary = b"".join(chunks)
    document = {
        "asset": {"version": "2.0", "generator": "cathxr hardware"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(placed), len(placed) + len(parents)))}],
        "nodes": [*placed, *parents],
        "meshes": listed,
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    total = 12 + 8 + len(text) + 8 + len(binary)
    return b"".join(
        [struct.pack("<4sII", b"glTF", 2, total), struct.pack("<I4s", len(text), b"JSON"), text,
         struct.pack("<I4s", len(binary), b"BIN\0"), binary]
    )  # fmt: skip


def _gltf_node(node: Node, mesh: int) -> dict[str, object]:
    matrix = np.eye(4)
    matrix[:3, :3] = _GLTF_FROM_BOX @ node.columns @ _GLTF_FROM_BOX.T
    matrix[:3, 3] = _GLTF_FROM_BOX @ node.origin * 1e-3
    return {"name": node.name, "mesh": mesh, "matrix": matrix.T.ravel().tolist()}
