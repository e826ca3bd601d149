"""The caps in heart.glb: a second primitive, with which the walls are closed."""

import numpy as np

from cathxr.heart.glb import Part, Patch, encode_glb, read_glb, surface
from cathxr.heart.surface import Surface, rim_edges, vertex_normals
from cathxr.heart.surfaces import surfaces_of

from .shapes import tube


def test_walls_and_caps_are_two_primitives_that_close_each_other(tmp_path):
    (made,) = surfaces_of(tube(), budget=4000)
    walls, caps = made.surface.keep(~made.caps), made.surface.keep(made.caps)
    part = Part(
        "aorta",
        walls.vertices_mm,
        vertex_normals(walls),
        walls.triangles,
        "#336699",
        0.5,
        Patch(caps.vertices_mm, vertex_normals(caps), caps.triangles),
    )
    path = tmp_path / "heart.glb"
    path.write_bytes(encode_glb([part], "", "test"))
    document, binary = read_glb(path)
    primitives = document["meshes"][0]["primitives"]
    assert [document["materials"][each["material"]]["name"] for each in primitives] == ["aorta", "caps"]
    alone, whole = (Surface(*surface(document, binary, "aorta", with_caps=with_caps)) for with_caps in (False, True))
    assert len(alone.triangles) == len(walls.triangles)
    assert len(rim_edges(alone)) > 0
    # The rim's vertices are there twice, at the same place to the last bit: welded, nothing is open.
    vertices, index = np.unique(whole.vertices_mm, axis=0, return_inverse=True)
    assert len(rim_edges(Surface(vertices, index.reshape(-1)[whole.triangles]))) == 0


def test_a_part_without_caps_has_one_primitive(tmp_path):
    (made,) = surfaces_of(tube(), budget=4000)
    part = Part("aorta", made.surface.vertices_mm, vertex_normals(made.surface), made.surface.triangles, "#336699")
    path = tmp_path / "heart.glb"
    path.write_bytes(encode_glb([part], "", "test"))
    document, _ = read_glb(path)
    assert len(document["meshes"][0]["primitives"]) == 1
    assert [each["name"] for each in document["materials"]] == ["aorta"]
