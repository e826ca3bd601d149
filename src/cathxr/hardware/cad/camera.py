"""What holds a camera: a carrier on three sprung screws that tilts, its strain relief, and the bought camera itself."""

from collections.abc import Iterator

import numpy as np

from cathxr.core import FloatArray
from cathxr.hardware.cad.frame import GREY, face_columns
from cathxr.hardware.cad.part import BOUGHT, PRINTED, Part, Place
from cathxr.hardware.cad.screws import pressed_spring, screw_places
from cathxr.hardware.cad.shapes import Solid, block, cut, joined, rod
from cathxr.hardware.layout import CARRIER_MM, PANEL_REST_MM, STANDOFF_MM, TILT_RADIUS_MM, Layout
from cathxr.hardware.panels import tilt_places
from cathxr.hardware.screws import joints

_PILOT_MM, _BOARD_MM = 1.8, 1.6


def camera_places(layout: Layout) -> Iterator[Place]:
    """Yield carrier and camera for both views. A carrier's own z looks away from the box; 0 is the lens's centre."""
    carrier = Part(
        "camera_carrier", "Camera carrier", PRINTED, _carrier(layout), GREY, (0.0, 0.0, 1.0),
        "Print with the stand-offs up.",
    )  # fmt: skip
    camera = Part("camera", "Camera with lens", BOUGHT, _camera(layout), (0.1, 0.35, 0.2))
    for axis, sign in (("z", 1.0), ("y", -1.0)):
        columns = face_columns(axis, sign)
        origin = layout.centre + layout.parameters.camera.distance_mm * columns[:, 2]
        yield Place(carrier, origin, columns, group="camera")
        yield Place(camera, origin, columns, group="camera")
        yield from _held(layout, origin, columns)


def _held(layout: Layout, origin: FloatArray, columns: FloatArray) -> Iterator[Place]:
    """Yield the springs and screws by which a carrier hangs and is tilted, and the screws of its camera board."""
    found, board = joints(layout), layout.parameters.camera.lens_ahead_mm
    back, plate = board - STANDOFF_MM, board - PANEL_REST_MM
    spring = pressed_spring("tilt_spring", "Pressure spring", back - CARRIER_MM - plate, 5.0, 0.6)

    def placed(local: list[tuple[float, float, float]]) -> FloatArray:
        return np.asarray(origin + np.array(local) @ columns.T)

    for place in placed([(u, v, plate) for u, v in tilt_places().tolist()]):
        yield Place(spring, place, columns, group="camera")
    heads = placed([(u, v, back) for u, v in tilt_places().tolist()])
    yield from screw_places(found["tilt"], heads, -columns[:, 2], group="camera")
    heads = placed([(u, v, board + _BOARD_MM) for u, v in _corners(layout)])
    yield from screw_places(found["board"], heads, -columns[:, 2], group="camera")


def _corners(layout: Layout) -> list[tuple[float, float]]:
    half = 0.5 * layout.parameters.camera.board_hole_mm
    return [(u, v) for u in (-half, half) for v in (-half, half)]


def _carrier(layout: Layout) -> Solid:
    camera = layout.parameters.camera
    board = camera.lens_ahead_mm
    top, low = board - STANDOFF_MM, board - STANDOFF_MM - CARRIER_MM
    half = 0.5 * camera.board_mm
    body = joined(
        rod((0.0, 0.0, low), "z", CARRIER_MM, 2.0 * (TILT_RADIUS_MM + 5.0)),
        *(rod((u, v, top), "z", STANDOFF_MM, 4.6) for u, v in _corners(layout)),
        # Strain relief: a block beside the board, with two slots for a cable tie.
        block((-8.0, -half - 13.0, low), (8.0, -half - 3.0, top + 8.0)),
    )
    tools = [rod((0.0, 0.0, low - 1.0), "z", CARRIER_MM + 2.0, camera.lens_mm + 8.0)]
    tools += [rod((u, v, low - 1.0), "z", 20.0, _PILOT_MM) for u, v in _corners(layout)]
    tools += [rod((u, v, low - 1.0), "z", CARRIER_MM + 2.0, 3.4) for u, v in tilt_places().tolist()]
    tools += [block((u - 1.2, -half - 14.0, top + 2.5), (u + 1.2, -half - 2.0, top + 5.0)) for u in (-5.0, 5.0)]
    # Fingers reach the lens's ring from both sides.
    tools += [block((sign * 7.0, -6.0, low - 1.0), (sign * 18.0, 6.0, low + 2.0)) for sign in (-1.0, 1.0)]
    return cut(body, tools)


def _camera(layout: Layout) -> Solid:
    camera = layout.parameters.camera
    half, board = 0.5 * camera.board_mm, camera.lens_ahead_mm
    plate = cut(
        block((-half, -half, board), (half, half, board + _BOARD_MM)),
        [rod((u, v, board - 1.0), "z", 4.0, 2.4) for u, v in _corners(layout)],
    )
    return joined(plate, rod((0.0, 0.0, -4.0), "z", board + 4.0, camera.lens_mm))
