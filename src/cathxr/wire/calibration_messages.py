"""The messages of the calibration pages: states of which only the newest matters."""

from typing import Literal

from pydantic import Field

from cathxr.wire.message import Message, Vector2

CalibrationStage = Literal["collecting", "solving", "done", "failed"]


class Figure(Message):
    """One result for people, with its unit, as text. level: how to colour it."""

    label: str
    value: str
    level: Literal["plain", "good", "warn", "bad"] = "plain"


class ResultPicture(Message):
    """A picture of a result. path: to GET from this server."""

    title: str
    path: str


class BoardView(Message):
    """One picture of the board that was kept, or why it was not."""

    name: str
    kept: bool
    reason: str = Field(description="Why it was rejected; empty when kept.")


class Coverage(Message):
    """How often a board's corner was in each cell of the picture: counts row by row."""

    columns: int
    rows: int
    counts: list[int]


class IntrinsicsState(Message):
    """A camera's lens being measured with a board."""

    type: Literal["calibrate_intrinsics"] = "calibrate_intrinsics"
    camera: str
    stage: CalibrationStage
    advice: str = Field(description="What to do next, or what came of it: one sentence for a person.")
    size_px: tuple[int, int]
    corners_px: list[Vector2] = Field(description="The board's corners in the newest picture, px; empty: no board.")
    corners_seq: int = Field(description="seq of the picture in which the corners were found.")
    is_still: bool = Field(description="The board does not move.")
    is_new: bool = Field(description="This view adds to those kept.")
    coverage: Coverage
    kept: int
    wanted: int = Field(description="Views that make a good calibration.")
    views: list[BoardView]
    figures: list[Figure]
    pictures: list[ResultPicture]


class MarkerState(Message):
    """One fiducial in one camera's picture. pixel: null where it is missing."""

    camera: str
    name: str
    colour: str
    pixel: Vector2 | None
    origin: Literal["found", "placed", "missing", "ambiguous"]
    residual: Vector2 | None = Field(description="Measured minus projected, px; null without a solution.")
    residual_px: float | None = Field(description="Its length.")


class MarkersState(Message):
    """The cameras' poses being measured with the fiducials."""

    type: Literal["calibrate_markers"] = "calibrate_markers"
    stage: CalibrationStage
    advice: str
    sizes_px: dict[str, tuple[int, int]] = Field(description="Picture size of each camera.")
    markers: list[MarkerState]
    can_save: bool = Field(description="The markers suffice for both poses, and the result may be saved.")
    figures: list[Figure]
    pictures: list[ResultPicture]


class DeviceState(Message):
    """One camera device. key: its pictures are at /cameras/{key}.jpg."""

    key: str
    device: str = Field(description="What the configuration calls it: an index or a path.")
    label: str
    role: Literal["", "top", "front"]
    suggestion: Literal["", "top", "front"] = Field(description="What the fiducials in its picture say it is.")
    settings: list[Figure] = Field(description="Exposure, gain, focus, white balance as they stand.")
    trouble: str = Field(description="Why it gives no pictures; empty when it does.")


class CamerasState(Message):
    """Devices being told apart, and their settings locked."""

    type: Literal["calibrate_cameras"] = "calibrate_cameras"
    stage: CalibrationStage
    advice: str
    devices: list[DeviceState]
    can_save: bool
    figures: list[Figure]


RollStep = Literal["zero", "backlash", "turn", "review"]


class RockingState(Message):
    """The encoder's gear being rocked between its stops. Angles rad of the catheter, from where the handle was held."""

    low_rad: float
    high_rad: float
    limit_rad: float = Field(description="A range wider than this is no play.")
    stops: int = Field(description="Stops so far, on the side that has fewer.")
    wanted: int


class RollCalibrationState(Message):
    """The roll being measured in the jig."""

    type: Literal["calibrate_roll"] = "calibrate_roll"
    stage: CalibrationStage
    step: RollStep
    steps: list[RollStep] = Field(description="Those of this run, in order.")
    advice: str
    is_simulated: bool = Field(description="A simulated hand does the steps, without hardware.")
    connected: bool = Field(description="The encoder reports.")
    count: int | None = Field(description="The board's count; null without an encoder.")
    turned_rad: float | None = Field(description="From where the handle was confirmed, or else from where it began.")
    zero_rad: float = Field(description="Where mark T points at zero, seen from the handle: clockwise from the right.")
    rate_hz: float | None = Field(description="Reports a second.")
    is_still: bool = Field(description="The handle has not moved for half a second.")
    is_valid: bool = Field(description="The count belongs to the rig's zero already.")
    rocking: RockingState | None = Field(description="In the step backlash.")
    can_confirm: bool
    why: str = Field(description="Why the step cannot be confirmed yet; empty when it can.")
    writes: str = Field(description="What saving changes of the gears, as `gear_ratio 2.0`; empty: nothing.")
    can_save: bool
    figures: list[Figure]


class HeartView(Message):
    """A picture of the heart from one side. path: to GET from this server; size_px: its width and height."""

    title: str
    path: str
    size_px: tuple[int, int]


class TouchedLandmark(Message):
    """One landmark to be touched. places: where it is in each view, as shares of its width and height."""

    name: str
    label: str
    status: Literal["waiting", "touched", "skipped"]
    places: list[Vector2]
    spread_mm: float | None = Field(
        description="Standard deviation of the resting tip (3D); null before it is touched."
    )
    residual_mm: float | None = Field(description="Left by the fit; not a target error.")
    held_out_mm: float | None = Field(description="Left by a fit to all the others.")


class TouchState(Message):
    """The heart being registered by touching landmarks with the tracked tip."""

    type: Literal["calibrate_registration"] = "calibrate_registration"
    stage: CalibrationStage
    advice: str
    is_simulated: bool = Field(description="A simulated hand touches the landmarks, without hardware.")
    kind: Literal["rigid", "similarity", "affine"]
    landmarks: list[TouchedLandmark]
    current: str | None = Field(description="The landmark to be touched now; null when none is left.")
    views: list[HeartView]
    tip_places: list[Vector2] = Field(description="Where the tip is in each view, by the landmarks so far; or empty.")
    is_tracked: bool
    trouble: str = Field(description="Why the tip is not tracked; empty when it is.")
    rest_share: float = Field(description="How much of the rest that it takes the tip has rested by now, 0 to 1.")
    rest_spread_mm: float | None = Field(description="Standard deviation of the resting tip (3D).")
    can_take: bool
    why: str = Field(description="Why the landmark cannot be taken yet; empty when it can.")
    can_finish: bool
    can_save: bool
    doubts: list[str] = Field(description="What is odd about the landmarks, the gravest first.")
    is_grave: bool = Field(description="One of the doubts says that the result should not be used.")
    figures: list[Figure]
    pictures: list[ResultPicture]


CalibrationState = IntrinsicsState | MarkersState | CamerasState | RollCalibrationState | TouchState
