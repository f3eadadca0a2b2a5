"""Where a camera is on the marker that a navigation system sees: HandEye."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, List, Optional, Tuple

from . import structs
from ._arrays import ArrayLike, BoolArray, FloatArray, Points, address_of, copied, empty, flat
from ._handle import Handle
from ._library import native, text
from .enums import HandEyeFlag, Verdict
from .registration import FreeMotion, free_motion, numbers


@dataclass(frozen=True)
class HandEyeResult:
    """Where a camera is on its marker; copies. World: where the camera's own poses are, such as a
    board, fixed to the navigation system."""

    verdict: Verdict
    """Never AMBIGUOUS."""
    reason: str
    """The verdict's, one sentence for people."""
    notes: List[str]
    """Remarks for people."""
    is_solved: bool
    """The transforms, covariance and residuals are those of the best solution; else it was refused
    before, and they are the identity, NaN and empty."""
    marker_from_camera: FloatArray
    """(3, 4) float64, a rotation and mm."""
    tracker_from_world: FloatArray
    """(3, 4) float64, the camera's world in the navigation system."""
    covariance: FloatArray
    """(6, 6) float64, of the motion that the true marker_from_camera has after this one: a turn
    about x, y, z of the marker's frame and about its origin, rad, then a shift, mm."""
    offset_estimated: bool
    offset_s: float
    """The navigation system's time is the camera's plus it."""
    offset_sigma_s: float
    """Its standard deviation."""
    offset_correlation: float
    """Correlation of both speeds of rotation, -1 to 1."""
    rms_mm: float
    """Root mean square of the residuals at the camera, of the poses that fit."""
    rms_rad: float
    error_ratio: float
    """Residuals in units of the errors."""
    camera_error_mm: float
    """The errors as stated or estimated."""
    camera_error_rad: float
    tracker_error_mm: float
    tracker_error_rad: float
    correlated: float
    """So many neighbours share an error."""
    turn_rad: float
    """Root mean square of the rotations against their mean."""
    cross_turn_rad: float
    """That of their parts across the main axis."""
    length_factor: float
    """What lengths of the camera's world are to be multiplied by to be the navigation system's; not
    applied."""
    length_factor_sigma: float
    used: int
    """Poses of the camera that were used."""
    inlier_count: int
    """Those of them that fit."""
    residuals_mm: FloatArray
    """(n,) float64, per pose of the camera; NaN where it was not used."""
    residuals_rad: FloatArray
    """(n,) float64, likewise."""
    inliers: BoolArray
    """(n,) bool, per pose of the camera: it fits."""
    free_motions: List[FreeMotion]
    """Motions of the transform that the poses leave open."""


class HandEye(Handle):
    """Finds where a camera is on its marker.

    camera_poses: (n, 12) or (n, 3, 4) or (n, 4, 4), world from camera: a rotation and mm.
    tracker_poses: likewise, navigation system from marker.
    camera_times, tracker_times: (n,), s, growing, each by its own clock; None: pose i of both
        belong together.
    errors: standard deviations along and about each axis: the camera's places in mm, its rotations
        in rad, and those of the marker; None: the residuals say how large they are.
    offset: the navigation system's time is the camera's plus it, s; None: it is estimated.
    max_offset: how far it is searched, s; default 2.
    max_residual_mm, max_residual_rad: where the root mean square of the residuals is larger, the
        calibration has failed; default 3 mm and 2 degrees.
    max_error_mm: a motion with a larger standard deviation, 100 mm from the camera, is
        undetermined; default 1.
    max_offset_error: likewise the offset, s; default 0.01.

    What fits nothing, or is not determined, raises nothing: result() says so. threads: any. Raises
    Error for poses and times that are none and for a number out of its range; TypeError and
    ValueError for arrays of another type or shape.
    """

    def __init__(
        self,
        camera_poses: ArrayLike,
        tracker_poses: ArrayLike,
        camera_times: Optional[ArrayLike] = None,
        tracker_times: Optional[ArrayLike] = None,
        *,
        errors: Optional[Tuple[float, float, float, float]] = None,
        offset: Optional[float] = None,
        max_offset: float = 0,
        max_residual_mm: float = 0,
        max_residual_rad: float = 0,
        max_error_mm: float = 0,
        max_offset_error: float = 0,
    ) -> None:
        if (camera_times is None) != (tracker_times is None):
            raise ValueError("camera_times and tracker_times: both expected, or none")
        camera, tracker = _poses("camera_poses", camera_poses), _poses(
            "tracker_poses", tracker_poses
        )
        desc = structs.HandEyeDesc(
            flags=0 if camera_times is not None else HandEyeFlag.PAIRED,
            camera_poses=camera.address,
            camera_count=camera.count,
            tracker_poses=tracker.address,
            tracker_count=tracker.count,
            max_offset_s=max_offset,
            max_residual_mm=max_residual_mm,
            max_residual_rad=max_residual_rad,
            max_error_mm=max_error_mm,
            max_offset_error_s=max_offset_error,
        )
        keep: List[Any] = []
        if camera_times is not None:
            desc.camera_times_s = _times("camera_times", camera_times, camera.count, keep)
            desc.tracker_times_s = _times("tracker_times", tracker_times, tracker.count, keep)
        if errors is not None:
            names = ("camera_error_mm", "camera_error_rad", "tracker_error_mm", "tracker_error_rad")
            for name, value in zip(names, flat("errors", errors, (4,))):
                setattr(desc, name, value)
        if offset is not None:
            desc.flags |= HandEyeFlag.KNOWN_OFFSET
            desc.offset_s = offset
        super().__init__(
            lambda out: native.defrec_hand_eye_create(desc, out), native.defrec_hand_eye_destroy
        )

    def result(self) -> HandEyeResult:
        """Where the camera is. threads: any"""
        info = structs.HandEyeInfo()
        with self._copying() as handle:
            native.defrec_hand_eye_get(handle, info)
            plain = {
                name: getattr(info, name)
                for name in HandEyeResult.__dataclass_fields__
                if isinstance(getattr(info, name, None), (int, float))
            }
            n, free = info.residual_count, range(info.free_motion_count)
            plain.update(
                verdict=Verdict(info.verdict),
                reason=text(info.reason),
                notes=text(info.notes).splitlines(),
                is_solved=info.is_solved != 0,
                offset_estimated=info.offset_estimated != 0,
                marker_from_camera=numbers(info.marker_from_camera, (3, 4)),
                tracker_from_world=numbers(info.tracker_from_world, (3, 4)),
                covariance=numbers(info.covariance, (6, 6)),
                residuals_mm=copied(info.residuals_mm, "d", (n,)),
                residuals_rad=copied(info.residuals_rad, "d", (n,)),
                inliers=copied(info.inliers, "?", (n,)),
                free_motions=[
                    free_motion(native.defrec_hand_eye_get_free_motion, handle, i) for i in free
                ],
            )
            return HandEyeResult(**plain)

    def camera_poses(self, marker_poses: ArrayLike) -> FloatArray:
        """Where the camera is for (n, 12) or (n, 3, 4) or (n, 4, 4) poses of its marker, navigation
        system from marker: (n, 3, 4) float64, navigation system from camera, what camera_pose of
        Tracker.submit takes where the calibration is of the rectified camera. threads: any. Raises
        Error, with Status.ERROR_STATE where the verdict is not ACCEPTED."""
        given = _poses("marker_poses", marker_poses)
        made: FloatArray = empty("d", (given.count, 3, 4))
        native.defrec_hand_eye_camera_pose(
            self._native, given.address, given.count, address_of(made)
        )
        return made

    def pose_covariance(self, marker_pose: ArrayLike) -> FloatArray:
        """How far off the pose may be that camera_poses gives for a (3, 4) or (4, 4) pose of the
        marker: (6, 6) float64, what Job.to_fixed_frame takes. threads: any. Raises Error, with
        Status.ERROR_STATE where the verdict is not ACCEPTED."""
        poses: Any = [marker_pose]
        given = _poses("marker_pose", poses)
        made: FloatArray = empty("d", (6, 6))
        native.defrec_hand_eye_pose_covariance(self._native, given.address, 1, address_of(made))
        return made


def _poses(name: str, value: ArrayLike) -> Points:
    """Rows of twelve numbers."""
    poses: Any = value
    try:
        rows = [flat(f"{name}[{i}]", pose, (12, 16))[:12] for i, pose in enumerate(poses)]
    except TypeError as error:
        raise TypeError(f"{name}: {error}") from None
    return Points(name, rows, 12)


def _times(name: str, value: Optional[ArrayLike], count: int, keep: List[Any]) -> int:
    given: Any = value
    try:
        rows = [[float(time)] for time in given]
    except (TypeError, ValueError):
        raise TypeError(f"{name}: numbers expected, {value!r} given") from None
    if len(rows) != count:
        raise ValueError(f"{name} has {len(rows)} times, {count} expected")
    times = Points(name, rows, 1)
    keep.append(times)
    return times.address
