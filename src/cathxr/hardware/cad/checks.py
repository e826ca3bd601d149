"""What must hold of the solids: sound, closed, printable, apart; markers and ROI in the cameras' sight."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.assembly import Rig3d
from cathxr.hardware.cad.part import ALWAYS, BOUGHT, CALIBRATION, SOFT, Part, Place
from cathxr.hardware.cad.screws import columns_along
from cathxr.hardware.cad.shapes import Solid, bounds
from cathxr.hardware.layout import MARKER_RADIUS_MM, Layout
from cathxr.hardware.meshes import TriangleMesh, first_hits, wall_mm

Progress = Callable[[str, float | None], None]
"""Called with what is being done and the share that is done (None: not known)."""
TOUCH_MM3 = 0.5
"""Less common volume than this is the rounding of faces that touch."""
_MESH_MM, _COARSE_MM, _ANGLE = 0.02, 0.2, 0.3
_SHARE_OF_BALL = 0.95


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong, or, where is_warning, only worth a look. what: the part or pair."""

    what: str
    sentence: str
    is_warning: bool = False


def mesh_of(solid: Solid, *, tolerance_mm: float = _MESH_MM) -> TriangleMesh:
    """Return a solid's surface as triangles, vertices merged."""
    vertices, faces = solid.tessellate(tolerance_mm, _ANGLE)
    points = np.array([tuple(each) for each in vertices]).reshape(-1, 3)
    return TriangleMesh(points, np.array(faces, dtype=np.int64).reshape(-1, 3)).merged()


def part_problems(part: Part, layout: Layout, meshes: dict[str, TriangleMesh]) -> Iterator[Problem]:
    """Yield what is wrong with a part that is printed."""
    printer = layout.parameters.printer
    if not part.solid.is_valid or len(part.solid.solids()) != 1:
        yield Problem(part.key, f"it is no single sound solid ({len(part.solid.solids())} pieces)")
        return
    mesh = meshes[part.key]
    if count := mesh.open_edges():
        yield Problem(part.key, f"its surface is not closed: {count} open edges")
    if abs(mesh.volume_mm3() - part.solid.volume) > 0.02 * part.solid.volume:
        yield Problem(part.key, f"its mesh holds {mesh.volume_mm3():.0f} mm3 and its solid {part.solid.volume:.0f}")
    size = printed_size(part)
    bed = np.array(printer.bed_mm)
    flat, room = np.sort(size[:2]), np.sort(bed[:2])
    if (flat > room).any() or size[2] > bed[2]:
        yield Problem(part.key, f"it needs {' x '.join(f'{each:.0f}' for each in size)} mm and the bed has "
                      f"{' x '.join(f'{each:g}' for each in bed)}")  # fmt: skip
    wall = wall_mm(mesh)
    least = printer.least_wall_mm * (0.5 if part.kind == SOFT else 1.0)
    if wall < least - 1e-3:
        yield Problem(part.key, f"a wall of {wall:.2f} mm is thinner than {least:g} mm", is_warning=True)


def printed_size(part: Part) -> FloatArray:
    """Return the size (3,) of a part as it lies on the bed, height last."""
    low, high = bounds(part.solid)
    up = int(np.abs(part.print_up).argmax())
    size = high - low
    return np.asarray([*np.delete(size, up), size[up]])


def interferences(places: Iterable[Place], *, report: Progress | None = None) -> list[Problem]:
    """Return every pair of placed parts that take the same room; pairs of bought parts are left out."""
    solids = [(each, each.solid()) for each in places]
    boxes = [bounds(solid) for _, solid in solids]
    pairs = [
        (first, second)
        for first, second in combinations(range(len(solids)), 2)
        if (boxes[first][0] < boxes[second][1] - 1e-3).all()
        and (boxes[second][0] < boxes[first][1] - 1e-3).all()
        and _may_meet(solids[first][0], solids[second][0])
    ]
    found = []
    for index, (first, second) in enumerate(pairs):
        if report is not None:
            report("Looking for parts in each other", index / len(pairs))
        common = solids[first][1] & solids[second][1]
        volume = 0.0 if common is None else sum(each.volume for each in common.solids())
        if volume > TOUCH_MM3:
            names = f"{solids[first][0].part.key} and {solids[second][0].part.key}"
            found.append(Problem(names, f"they share {volume:.1f} mm3"))
    return found


def _may_meet(first: Place, second: Place) -> bool:
    """Return whether a pair is there at the same time and is not meant to touch by force."""
    if first.setup and second.setup and first.setup != second.setup:
        return False
    return not (first.part.kind == BOUGHT and second.part.kind == BOUGHT)


def sight_problems(rig: Rig3d, meshes: dict[str, TriangleMesh]) -> Iterator[Problem]:
    """Yield what the cameras do not see in the CAD: balls with both crosses in, places in the ROI, the lit diffuser."""
    layout = rig.layout
    distance = layout.parameters.camera.distance_mm
    axes = {"top": np.array([0.0, 0.0, 1.0]), "front": np.array([0.0, -1.0, 0.0])}
    crosses = _triangles([each for each in rig.within([CALIBRATION]) if not _is_seen_through(each)], meshes)
    plain = [each for each in rig.within([ALWAYS]) if not _is_seen_through(each)]
    whole, keys = _triangles(plain, meshes), _keys(plain, meshes)
    for name, axis in axes.items():
        eye = layout.centre + distance * axis
        for side, balls in layout.marker_places.items():
            for index, centre in enumerate(balls):
                targets = _ball_front(centre, eye)
                met, _ = _first_seen(eye, targets, crosses)
                if hidden := int((met < 1.0 - 1e-4).sum()):
                    share = 100.0 * hidden / len(targets)
                    yield Problem(f"{name} camera", f"ball {index + 1} of the {side} cross is hidden by {share:.0f} %")
        places = layout.centre + layout.half_mm * np.random.default_rng(0).uniform(-1.0, 1.0, (600, 3))
        met, which = _first_seen(eye, places, whole)
        if hidden := int((met < 1.0).sum()):
            yield Problem(f"{name} camera", f"{hidden} of 600 places in the ROI are hidden")
        on_light = np.array([keys[index] == "diffuser" for index in which])
        least = layout.parameters.light.least_share
        # 600 rays tell a share to about half a per cent.
        if on_light.mean() < least - 0.008:
            yield Problem(f"{name} camera", f"{100 * on_light.mean():.1f} % of the rays end on the diffuser")


def _first_seen(eye: FloatArray, targets: FloatArray, triangles: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what `first_hits` does for rays from one eye to targets (N, 3); what lies beside them is left out."""
    rays = targets - eye
    z = rays.mean(axis=0) / np.linalg.norm(rays.mean(axis=0))
    axes = columns_along(z)
    seen, corners = rays @ axes, (triangles - eye) @ axes
    slopes = seen[:, :2] / seen[:, 2:]
    low, high = slopes.min(axis=0) - 1e-6, slopes.max(axis=0) + 1e-6
    depth = corners[:, :, 2:]
    # A triangle that reaches behind the eye is kept whatever its corners say.
    behind = corners[:, :, 2].min(axis=1) <= 1e-6
    across = corners[..., :2] / np.maximum(depth, 1e-6)
    kept = np.flatnonzero(behind | ((across.min(axis=1) <= high) & (across.max(axis=1) >= low)).all(axis=1))
    met, which = first_hits(np.broadcast_to(eye, rays.shape), rays, triangles[kept])
    return met, np.where(which >= 0, kept[which] if len(kept) else which, -1)


def _is_seen_through(place: Place) -> bool:
    return place.part.key in ("camera", "camera_carrier") or place.part.key.startswith("ball_")


def _ball_front(centre: FloatArray, eye: FloatArray) -> FloatArray:
    """Return points (N, 3) on the side of a ball that the eye sees, nearly to its outline."""
    sight = (eye - centre) / np.linalg.norm(eye - centre)
    side = np.cross(sight, [1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * np.cross(sight, side)
    parts = [centre[None] + MARKER_RADIUS_MM * sight]
    for share in (0.5, _SHARE_OF_BALL):
        parts.append(centre + MARKER_RADIUS_MM * (share * ring + np.sqrt(1.0 - share**2) * sight))
    return np.vstack(parts)


def _triangles(places: Iterable[Place], meshes: dict[str, TriangleMesh]) -> FloatArray:
    return np.concatenate([meshes[each.part.key].moved(each.columns, each.origin).triangles for each in places])


def _keys(places: Iterable[Place], meshes: dict[str, TriangleMesh]) -> list[str]:
    return [each.part.key for each in places for _ in range(len(meshes[each.part.key].faces))] + [""]


def all_problems(rig: Rig3d, *, report: Progress | None = None) -> list[Problem]:
    """Return everything that is wrong with a rig, warnings included."""
    tell = report or (lambda what, share: None)
    found: list[Problem] = []
    parts = rig.parts
    meshes: dict[str, TriangleMesh] = {}
    made = rig.made()
    for index, (key, part) in enumerate(parts.items()):
        tell("Meshing and measuring the parts", index / len(parts))
        meshes[key] = mesh_of(part.solid)
        if key in made:
            found += part_problems(part, rig.layout, meshes)
    seen = {each.part.key for each in rig.within([CALIBRATION])}
    coarse = {key: mesh_of(part.solid, tolerance_mm=_COARSE_MM) for key, part in parts.items() if key in seen}
    tell("Looking with both cameras", None)
    found += sight_problems(rig, coarse)
    return found + interferences(rig.places, report=report)
