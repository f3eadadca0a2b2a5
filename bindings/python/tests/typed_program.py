"""A user's program, for mypy --strict alone: what it names must be exported, and have these
types."""
from typing import List, Optional

import numpy as np
import numpy.typing as npt
from typing_extensions import assert_type

import defrec
from defrec import Context, Job, Rig, State, Tracker


def first_error(left: str, right: str, calibration: str) -> float:
    for frame in defrec.track(left, right, calibration, points=[(400, 300)]):
        points: Optional[defrec.FollowedPoints] = frame.points
        if points is not None and frame.state == State.TRACKING:
            return float(points.expected_error_mm[0])
    raise defrec.Error(defrec.Status.ERROR_STATE, "no surface")


def arrays(
    frame: defrec.TrackedFrame, model: "npt.NDArray[np.float64]"
) -> "npt.NDArray[np.float64]":
    """Arrays have types of their elements, not Any."""
    assert_type(frame.result.vertices, "npt.NDArray[np.float32]")
    assert_type(frame.result.vertex_status, "npt.NDArray[np.uint8]")
    assert_type(frame.result.landmark_matches, "npt.NDArray[np.void]")
    moved = frame.warp_points(model)
    assert_type(moved.xyz, "npt.NDArray[np.float64]")
    assert_type(moved.status, "npt.NDArray[np.uint8]")
    seen: "npt.NDArray[np.float64]" = moved.xyz[moved.status == defrec.PointStatus.OBSERVED]
    return seen


def states(camera: defrec.Camera, left: bytes, right: bytes) -> List[State]:
    found: List[State] = []
    with Context() as context, Rig.rectified(context, 96, 80, camera) as rig:
        tracker = Tracker(context, rig, "cpu", format=defrec.Format.GRAY8)
        job: Job
        for job in tracker.process([(left, right, 0)]):
            found.append(job.result().state)
    return found


def plan(tracker: Tracker, left: bytes, right: bytes) -> List[float]:
    with tracker.submit(
        left, right, 0, held_motion=[(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)]
    ) as job:
        with job.template() as template:
            sphere = defrec.Mesh([(0.0, 0.0, 50.0)], [(0, 0, 0)])
            template.set_body(sphere, [defrec.BodyRegion(sphere, held=True)], poisson_ratio=0.4)
            if not template.wait_body(2.5):
                return []
            targets = defrec.Targets(template, [(0, 0, 60)])
        moved: defrec.MovedTargets = job.move_targets(targets)
        fixed: defrec.FixedPoints = job.to_fixed_frame(moved.xyz, moved.covariance)
        if job.result().body != defrec.BodyState.READY or len(fixed.xyz) == 0:
            return []
        return [float(error) for error in moved.expected_error_mm]


def registered(context: Context, template: defrec.Template, mesh: defrec.Mesh) -> List[float]:
    with defrec.Registration.from_template(context, template, mesh, starts=40) as found:
        result: defrec.RegistrationResult = found.result()
        if result.verdict != defrec.Verdict.ACCEPTED:
            return [motion.expected_mm for motion in result.free_motions]
        moved: defrec.RegisteredPoints = found.move_points([(0, 0, 0)])
        return [float(error) for error in moved.expected_error_mm]


def camera_pose(marker: List[List[float]], poses: List[List[List[float]]]) -> float:
    with defrec.HandEye(poses, poses, errors=(0.1, 0.001, 0.1, 0.001)) as hand_eye:
        result: defrec.HandEyeResult = hand_eye.result()
        variance = float(hand_eye.pose_covariance(marker)[3][3])
        return float(hand_eye.camera_poses([marker])[0][0][3]) + result.offset_s + variance
