"""The twin's tip put into a phantom's holes: the controls that reach them, and a hand that visits them in order."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from cathxr.core import ConfigError, FloatArray, Rig
from cathxr.core.phantom import Phantom
from cathxr.twin.kinematics import CatheterBody, Controls, centreline
from cathxr.twin.settings import TwinSettings
from cathxr.twin.world import CONTROL_RANGES, TwinWorld

TOLERANCE_MM = 0.005
_EASY_BEND_DEG, _MOST_BEND_DEG = 120.0, 230.0
_REACH_MM = 35.0
_POINTS = 50
_STARTS = tuple((bend, longer) for bend in (20.0, 60.0, 100.0, 160.0) for longer in (1.0, 1.2, 1.5))
_HOME = np.array([25.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class Stops:
    """A Motion from stop to stop: stops (N + 1, 4), of which it leaves the first at time zero.

    Travel takes travel_s and each rest dwell_s. Travel has least jerk: no rate and no acceleration where a rest begins
    and ends. After the last stop it stays.
    """

    stops: FloatArray
    travel_s: float
    dwell_s: float

    def at(self, t_s: float) -> FloatArray:
        """Return (3, 4); see `Motion`."""
        last = len(self.stops) - 2
        index = int(np.clip(t_s // (self.travel_s + self.dwell_s), 0, last))
        x = float(np.clip((t_s - index * (self.travel_s + self.dwell_s)) / self.travel_s, 0.0, 1.0))
        begin, way = self.stops[index], self.stops[index + 1] - self.stops[index]
        value = x**3 * (10.0 + x * (6.0 * x - 15.0))
        rate = 30.0 * x * x * (1.0 + x * (x - 2.0)) / self.travel_s
        change = 60.0 * x * (1.0 + x * (2.0 * x - 3.0)) / self.travel_s**2
        return np.stack([begin + value * way, rate * way, change * way])

    def rest_s(self, index: int) -> tuple[float, float]:
        """Return when the rest of an index (0: after the first travel) begins and ends, s."""
        begin = index * (self.travel_s + self.dwell_s) + self.travel_s
        return begin, begin + self.dwell_s


@dataclass(frozen=True)
class HoleRest:
    """One rest of the tip in a hole (by its index in the phantom): from begin_ns to end_ns on the world's clock."""

    hole: int
    begin_ns: int
    end_ns: int


@dataclass(frozen=True, eq=False)
class PhantomVisit:
    """A world whose tip visits a phantom's holes. rests: in order; seated_box (N, 3) mm: where the tip truly is."""

    world: TwinWorld
    rests: tuple[HoleRest, ...]
    seated_box: FloatArray

    @property
    def end_ns(self) -> int:
        """When the last rest ends."""
        return self.rests[-1].end_ns


def visit(
    rig_true: Rig,
    phantom: Phantom,
    *,
    seed: int = 0,
    settings: TwinSettings | None = None,
    start_ns: int = 0,
    travel_s: float = 1.2,
    dwell_s: float = 2.0,
    rounds: int = 1,
    seat_std_mm: float = 0.0,
) -> PhantomVisit:
    """Return a world whose tip rests in each hole in order, `rounds` times over, from start_ns on.

    seat_std_mm: the holes' play: the tip rests this far off along each axis (standard deviation), by seed, and
    elsewhere on every visit.

    Raises:
        ConfigError: the catheter cannot reach a hole; the sentence names it.
        ValueError: a duration that is not positive, or no round.
    """
    if not (travel_s > 0 and dwell_s > 0 and rounds >= 1 and seat_std_mm >= 0):
        raise ValueError("visit: expected positive travel_s and dwell_s, at least one round and no negative play")
    world = TwinWorld(rig_true, seed=seed, settings=settings, start_ns=start_ns)
    order = np.tile(np.arange(len(phantom.holes)), rounds)
    play = np.random.default_rng([seed, 0x9401E]).normal(0.0, 1.0, size=(len(order), 3))
    seated = phantom.positions_mm[order] + seat_std_mm * play
    names = [phantom.holes[hole].name for hole in order]
    motion = Stops(np.vstack([_HOME, reaching(world.body, seated, names=names)]), travel_s, dwell_s)
    world = TwinWorld(rig_true, seed=seed, settings=settings, start_ns=start_ns, motion=motion)
    rests = tuple(
        HoleRest(int(hole), *(start_ns + round(each * 1e9) for each in motion.rest_s(index)))
        for index, hole in enumerate(order)
    )
    return PhantomVisit(world, rests, seated)


def reaching(body: CatheterBody, tips_box: FloatArray, *, names: Sequence[str]) -> FloatArray:
    """Return controls (N, 4) with which the tip is at each of tips_box (N, 3) mm, to TOLERANCE_MM.

    Of several ways the least bent is taken. Roll turns gently from one to the next; only where the tip gets no farther
    does it turn the catheter's own bend towards the place.

    Raises:
        ConfigError: there is no way to a place within the controls' ranges; the sentence names it.
    """
    found = []
    for index, (tip, name) in enumerate(zip(tips_box, names, strict=True)):
        place, roll_deg = np.asarray(tip, dtype=np.float64), 20.0 * float(np.sin(1.3 * index))
        controls = _reached(body, place, roll_deg=roll_deg)
        if controls is None:
            controls = _reached(body, place, roll_deg=_helpful_roll_deg(body, place))
        if controls is None:
            raise ConfigError(
                f"The twin's catheter cannot put its tip into hole {name} at "
                f"({', '.join(f'{each:.1f}' for each in tip)}) mm. It gets about {_REACH_MM:.0f} mm off the "
                f"inlet's axis from x = 20 mm on, and less nearer to the inlet: move the hole."
            )
        found.append(controls)
    return np.stack(found)


def _reached(body: CatheterBody, tip: FloatArray, *, roll_deg: float) -> FloatArray | None:
    """Return the least bent controls (4,) at a roll that bring the tip to a place (3,); None when there are none."""
    side = _side_rad(body, tip) - np.deg2rad(roll_deg)
    least, most = CONTROL_RANGES["insertion_mm"]
    best: FloatArray | None = None

    def off(values: FloatArray) -> FloatArray:
        controls = Controls(float(values[0]), roll_deg, float(values[1]), float(values[2]))
        return np.asarray(centreline(body, controls, points=_POINTS)[0][0] - tip)

    for bend, longer in _STARTS:
        start = [
            float(np.clip(longer * np.linalg.norm(tip), least + 1.0, most - 1.0)),
            bend * np.cos(side),
            bend * np.sin(side),
        ]
        bounds = ([least, -270.0, -270.0], [most, 270.0, 270.0])
        solved = least_squares(off, start, bounds=bounds, x_scale=[10.0, 30.0, 30.0], xtol=1e-12, ftol=1e-14)
        flexion = float(np.hypot(solved.x[1], solved.x[2]))
        if float(np.linalg.norm(solved.fun)) > TOLERANCE_MM or flexion > _MOST_BEND_DEG:
            continue
        if best is None or flexion < np.hypot(best[2], best[3]) - 1e-6:
            best = np.array([solved.x[0], roll_deg, solved.x[1], solved.x[2]])
        if flexion < _EASY_BEND_DEG:
            break
    return best


def _side_rad(body: CatheterBody, tip: FloatArray) -> float:
    """Return where a place (3,) lies about the inlet's axis: from anterior at roll zero towards the left."""
    aside = body.entry_frame.T @ tip
    return float(np.arctan2(aside[1], aside[0]))


def _helpful_roll_deg(body: CatheterBody, tip: FloatArray) -> float:
    """Return the roll, -180 to 180, at which the body's own bend leads towards a place (3,)."""
    roll = _side_rad(body, tip) - float(np.arctan2(body.memory_per_mm[1], body.memory_per_mm[0]))
    return float(np.rad2deg(np.arctan2(np.sin(roll), np.cos(roll))))
