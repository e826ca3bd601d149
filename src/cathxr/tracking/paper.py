"""The paper method's 3D half (arXiv 2411.02611): X from both views, Y from the top view, Z from the front view."""

import numpy as np

from cathxr.core import Detection, FloatArray, Observation, Rig, Status, Track
from cathxr.geometry.curves import resampled, tip_pose
from cathxr.geometry.fiducial_plane import FiducialPlane
from cathxr.geometry.roll import tip_roll_rad
from cathxr.tracking.continuity import Continuity, missing_reason

_VIEWS = ("top", "front")
_LEAST_DISAGREEMENT_MM = 5.0


class PaperTracker:
    """A Tracker: each view's path in its rectified plane, K equal parts each, joined coordinate by coordinate.

    Faithful to the paper, weaknesses included: a plane's homography holds on the plane only, and equal parts of the two
    paths are not the same points of the catheter. sigma_mm says how large the first of these is.

    Raises (when made):
        ConfigError: the rig's markers cannot carry the paper method.
        ValueError: fewer than two points.
    """

    def __init__(self, rig: Rig, *, points: int = 50) -> None:
        if points < 2:
            raise ValueError(f"points: expected at least 2, got {points}")
        self._points = points
        self._zero_direction, self._roll = rig.zero_direction, rig.roll
        self._planes = {view: FiducialPlane.of(rig, view) for view in _VIEWS}
        self._continuity = Continuity()
        self._most_disagreement_mm = _LEAST_DISAGREEMENT_MM + _parallax_mm(rig, self._planes)

    def update(self, observation: Observation) -> Track:
        """Return the Track of one observation."""
        missing = missing_reason(observation)
        if missing is not None:
            return self._continuity.coasting(observation, missing)
        detections = [observation.detection(view) for view in _VIEWS]
        if detections[0] is None or detections[1] is None:
            return self._continuity.lost(observation, "no picture from one camera")
        for view, detection in zip(_VIEWS, detections, strict=True):
            if detection is not None and detection.reason is not None:
                return self._continuity.lost(observation, f"{view}: {detection.reason}")
        try:
            return self._joined(observation, detections[0], detections[1])
        except ValueError as error:
            return self._continuity.lost(observation, f"no usable shape ({error})")

    def reset(self) -> None:
        """Forget the last Track."""
        self._continuity.reset()

    def _joined(self, observation: Observation, top: Detection, front: Detection) -> Track:
        """Return the Track of two detections. Raises ValueError where they give no curve."""
        top_mm = resampled(self._planes["top"].to_plane(top.curve_px), self._points)
        front_mm = resampled(self._planes["front"].to_plane(front.curve_px), self._points)
        apart_mm = max(abs(float(top_mm[0, 0] - front_mm[0, 0])), abs(float(top_mm[:, 0].max() - front_mm[:, 0].max())))
        if apart_mm > self._most_disagreement_mm:
            return self._continuity.lost(observation, f"the two views disagree by {apart_mm:.0f} mm along x")
        along = 0.5 * (top_mm[:, 0] + front_mm[:, 0])
        shape_box = resampled(np.column_stack([along, top_mm[:, 1], front_mm[:, 1]]), self._points)
        roll = observation.roll_rad
        turn = tip_roll_rad(self._roll, shape_box=shape_box, roll_rad=roll)
        pose = tip_pose(shape_box, zero_direction=self._zero_direction, roll_rad=turn)
        sigma = self._sigma_mm(shape_box[0], {"top": top, "front": front})
        return self._continuity.tracked(
            Track(
                seq=observation.seq,
                t_ns=observation.t_ns,
                status=Status.TRACKED,
                shape_box=shape_box,
                box_from_tip=pose,
                roll_rad=roll,
                roll_predicted=observation.roll_predicted,
                sigma_mm=sigma,
            )
        )

    def _sigma_mm(self, tip_box: FloatArray, detections: dict[str, Detection]) -> float:
        """Return the tip's standard deviation: the homographies' bias, and what the pictures left open at the tip.

        The bias is seen from the tip itself: were it right, each camera would see it, in its rectified plane, where the
        method says it is. The difference is what the plane's homography got wrong for a point that far off the plane.
        """
        variance = 0.0
        for view, detection in detections.items():
            plane = self._planes[view]
            claimed = tip_box[list(plane.axes)]
            seen = plane.apparent(tip_box)
            variance += float(np.square(seen - claimed).sum())
            tip_mm = plane.to_plane(np.stack([detection.curve_px[0], detection.curve_px[0] + 1.0]))
            mm_per_px = float(np.linalg.norm(tip_mm[1] - tip_mm[0]) / np.sqrt(2.0))
            # Each view gives the tip along the catheter and across it; x is the mean of both views.
            variance += 0.5 * ((detection.tip_sigma_px or 0.0) ** 2 + float(detection.sigma_px[0]) ** 2) * mm_per_px**2
        return float(np.sqrt(variance))


def _parallax_mm(rig: Rig, planes: dict[str, FiducialPlane]) -> float:
    """Return how far the two views may differ along x, mm, for a point of the ROI that lies off both planes."""
    corners = rig.roi.corners_mm
    shifts = [np.abs(plane.apparent(corners)[:, 0] - corners[:, 0]).max() for plane in planes.values()]
    return float(sum(shifts))
