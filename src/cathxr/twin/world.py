"""The simulated box's state: where the catheter is at any instant, by script or by a steering hand."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from cathxr.core import FloatArray, Pose, Rig, Status, Track
from cathxr.twin import manoeuvres
from cathxr.twin.kinematics import CatheterBody, Controls, centreline
from cathxr.twin.motion import Follow, Harmonics, Motion
from cathxr.twin.settings import TwinSettings

CONTROL_RANGES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "insertion_mm": (5.0, 130.0),
        "roll_deg": (-720.0, 720.0),
        "anterior_deg": (-270.0, 270.0),
        "left_deg": (-270.0, 270.0),
    }
)
_RATE_LIMITS = np.array([120.0, 360.0, 240.0, 240.0])
_STIFFNESS = 9.0
_MEMORY_NS = 60_000_000_000
_STATE_POINTS = 201
_SOFT_MM = 0.4


@dataclass(frozen=True, eq=False)
class CatheterState:
    """The exact catheter at one instant: shape_box (N, 3) mm **tip first**, finely sampled, uniform in arc length."""

    t_ns: int
    controls: Controls
    shape_box: FloatArray
    box_from_tip: Pose
    roll_rad: float


class TwinWorld:
    """What is true in the simulated box. A pure function of seed and time until someone steers.

    rig_true: the box as it really is. start_ns: the instant at which the scripted manoeuvre has run for 0 s. motion:
    what moves the catheter instead of the settings' manoeuvre.
    After steering, states of the last minute stay exact; older ones are forgotten. Any number of threads may read while
    one steers: what they read is replaced whole, never changed.
    """

    def __init__(
        self,
        rig_true: Rig,
        *,
        seed: int = 0,
        settings: TwinSettings | None = None,
        start_ns: int = 0,
        motion: Motion | None = None,
    ) -> None:
        self.rig_true = rig_true
        self.seed = seed
        self.settings = TwinSettings() if settings is None else settings
        self.start_ns = start_ns
        self.body = _body(rig_true, seed, self.settings)
        begun = manoeuvres.script(self.settings.manoeuvre, seed=seed) if motion is None else motion
        self._epochs: tuple[tuple[int, Motion], ...] = ((start_ns, begun),)

    @property
    def manoeuvres(self) -> tuple[str, ...]:
        """The names that `manoeuvre` takes."""
        return manoeuvres.NAMES

    @property
    def control_ranges(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest value of each control, by the names that `steer` takes."""
        return CONTROL_RANGES

    def controls(self, t_ns: int) -> Controls:
        """Return the controls as they stand at an instant."""
        return self._controls(self._state(t_ns)[0])

    def state(self, t_ns: int) -> CatheterState:
        """Return the catheter at an instant."""
        controls = self.controls(t_ns)
        shape, box_from_tip = centreline(self.body, controls, points=_STATE_POINTS)
        return CatheterState(t_ns, controls, shape, box_from_tip, float(np.deg2rad(controls.roll_deg)))

    def truth(self, t_ns: int, *, seq: int = 0, points: int = 50) -> Track:
        """Return the exact Track of an instant: `points` points, sigma 0; lost when the scene has no catheter."""
        if not self.settings.catheter:
            return Track(seq, t_ns, Status.LOST, reason="no catheter in the scene")
        controls = self.controls(t_ns)
        shape, box_from_tip = centreline(self.body, controls, points=points)
        roll = float(np.deg2rad(controls.roll_deg))
        return Track(seq, t_ns, Status.TRACKED, shape_box=shape, box_from_tip=box_from_tip, roll_rad=roll, sigma_mm=0.0)

    def steer(
        self,
        t_ns: int,
        *,
        insertion_mm: float | None = None,
        roll_deg: float | None = None,
        anterior_deg: float | None = None,
        left_deg: float | None = None,
    ) -> Controls:
        """Return the setpoints after setting those given; the catheter moves to them smoothly from `t_ns` on.

        A running script stops: controls that are not given keep their last setpoint or, after a script, glide to rest.
        Values are limited to `control_ranges`.

        Raises:
            ValueError: a value is not a finite number.
        """
        wanted = (insertion_mm, roll_deg, anterior_deg, left_deg)
        start_ns, state = self._takeover(t_ns)
        target = self._standing_target(state)
        for i, (name, value) in enumerate(zip(CONTROL_RANGES, wanted, strict=True)):
            if value is not None:
                if not np.isfinite(value):
                    raise ValueError(f"{name}: expected a finite number, got {value}")
                target[i] = np.clip(value, *CONTROL_RANGES[name])
        self._follow(Harmonics.held(target), start_ns, state)
        return Controls(*(float(each) for each in target))

    def manoeuvre(self, t_ns: int, name: str) -> None:
        """Go over smoothly to the named script from `t_ns` on.

        Raises:
            ValueError: no such manoeuvre.
        """
        goal = manoeuvres.script(name, seed=self.seed)
        start_ns, state = self._takeover(t_ns)
        self._follow(goal, start_ns, state)

    def _takeover(self, t_ns: int) -> tuple[int, FloatArray]:
        """Return when a change made at t_ns takes effect (never before the last one) and the state then."""
        start_ns = max(t_ns, self._epochs[-1][0] if len(self._epochs) > 1 else t_ns)
        return start_ns, self._state(start_ns)

    def _standing_target(self, state: FloatArray) -> FloatArray:
        """Return setpoints (4,) of controls that nobody moves: the last, else where each stops without turning back."""
        motion = self._epochs[-1][1]
        if isinstance(motion, Follow) and _is_held(motion.goal):
            return np.array(motion.goal.at(0.0)[0], dtype=np.float64)
        # For the damped offset of `Follow`, a stop 2 v / stiffness ahead is approached from one side only.
        least, most = np.array(list(CONTROL_RANGES.values())).T
        return np.asarray(np.clip(state[0] + 2.0 * state[1] / _STIFFNESS, least, most), dtype=np.float64)

    def _follow(self, goal: Motion, start_ns: int, state: FloatArray) -> None:
        motion = Follow.towards(
            goal,
            start_s=self._seconds(start_ns),
            state=state,
            stiffness=_STIFFNESS,
            rate_limits=_RATE_LIMITS,
        )
        horizon = start_ns - _MEMORY_NS
        epochs = (*self._epochs, (start_ns, motion))
        # An epoch is over when the next begins; the newest never is.
        begins = [then for then, _ in epochs[1:]] + [start_ns]
        self._epochs = tuple(each for each, over_ns in zip(epochs, begins, strict=True) if over_ns > horizon)

    def _state(self, t_ns: int) -> FloatArray:
        """Return value, rate and acceleration (3, 4) of the controls."""
        epochs = self._epochs
        active = next((motion for start, motion in reversed(epochs) if start <= t_ns), epochs[0][1])
        return active.at(self._seconds(t_ns))

    def _seconds(self, t_ns: int) -> float:
        return (t_ns - self.start_ns) * 1e-9

    def _controls(self, values: FloatArray) -> Controls:
        # A soft floor: overshoot at the shortest insertion must neither pull the tip into the inlet nor kink the path.
        over = (float(values[0]) - self.body.least_insertion_mm) / _SOFT_MM
        insertion = self.body.least_insertion_mm + _SOFT_MM * float(np.logaddexp(0.0, over))
        return Controls(insertion, float(values[1]), float(values[2]), float(values[3]))


def _is_held(motion: Motion) -> bool:
    return isinstance(motion, Harmonics) and motion.amplitude.size == 0


def _body(rig: Rig, seed: int, settings: TwinSettings) -> CatheterBody:
    """Return the catheter of this seed: a slight tilt in the inlet and a bend of its own."""
    rng = np.random.default_rng([seed, 0xB0D7])
    tilt = np.deg2rad(settings.entry_tilt_deg) * rng.uniform(-1.0, 1.0, size=2) / np.sqrt(2.0)
    side = rng.uniform(0.0, 2.0 * np.pi)
    memory = np.deg2rad(settings.memory_deg_per_mm) * rng.uniform(0.5, 1.0)
    return CatheterBody.of(
        radius_mm=0.5 * rig.catheter.diameter_mm,
        tilt_rad=tilt,
        zero_direction=rig.zero_direction,
        memory_per_mm=memory * np.array([np.cos(side), np.sin(side)]),
        torsion_per_mm=float(np.deg2rad(settings.torsion_deg_per_mm)),
        torsion_per_bend=settings.torsion_deg_per_quarter_bend / 90.0,
    )
