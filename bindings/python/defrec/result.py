"""What a frame gave; everything in it is a copy and outlives the job."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any, NamedTuple, Optional, Tuple

from . import structs
from ._arrays import ByteArray, DisparityArray, FloatArray, RecordArray, copied
from ._library import text
from .enums import MAX_TIMED_STAGES, BodyState, Reason, State
from .structs import Landmark, Match, Motion, PatchObservation, Piece


class StageTime(NamedTuple):
    """How long one step of a frame took; see timed of Tracker."""

    name: str
    milliseconds: float


class LiftedPoints(NamedTuple):
    """What lies under pixels of a frame."""

    xyz: FloatArray
    """(n, 3) float64, mm, template frame; 0 where nothing was found."""
    found: ByteArray
    """(n,) uint8, Found."""


class WarpedPoints(NamedTuple):
    """Points of the template frame, moved to a frame."""

    xyz: FloatArray
    """(n, 3) float64, mm, rectified camera."""
    status: ByteArray
    """(n,) uint8, PointStatus."""
    expected_error_mm: FloatArray
    """(n,) float64, root mean square of the 3D error to be expected."""


class MovedTargets(NamedTuple):
    """Targets of a plan, moved to a frame."""

    xyz: FloatArray
    """(n, 3) float64, mm, rectified camera."""
    status: ByteArray
    """(n,) uint8, PointStatus; never OBSERVED beneath the surface."""
    expected_error_mm: FloatArray
    """(n,) float64, root mean square of the 3D error to be expected: the root of the covariance's
    trace."""
    covariance: FloatArray
    """(n, 6) float64, xx, xy, xz, yy, yz, zz of the error, mm^2, rectified camera."""


class PointCovariances(NamedTuple):
    """How far off the positions of WarpedPoints may be, by direction, and what was observed
    there."""

    covariance: FloatArray
    """(n, 6) float64, xx, xy, xz, yy, yz, zz, mm^2, rectified camera; the root of the trace is the
    expected error."""
    evidence: ByteArray
    """(n,) uint8, Evidence."""


@dataclass(frozen=True)
class Result:
    """State, reasons and surface of one frame. Lengths in mm; without a template the arrays are
    empty."""

    state: State
    reasons: Reason
    epoch: int
    """Counts templates and relocalisations."""
    timestamp_ns: int
    frame: int
    """Counts submitted frames from 0."""
    age: int
    """Frames since the geometry was last supported by evidence."""
    features: int
    """Found in the left image."""
    matches: int
    """Of them matched to landmarks, with depth."""
    inliers: int
    """Of them preselected."""
    patches: int
    """Found by guided search."""
    observed_share: float
    """0 to 1, of the vertices inside the image."""
    mean_residual_mm: float
    """Mean |depth residual| of the vertices whose depth agrees."""
    patch_residual_px: float
    """RMS distance between found and deformed patches."""
    rigid_motion: FloatArray
    """(3, 4) float64, rectified camera from template frame: best rigid fit of all vertices."""
    motions: RecordArray
    """(nodes,) Motion, per control point, rectified camera from template frame."""
    node_positions: FloatArray
    """(nodes, 3) float32, now."""
    vertices: FloatArray
    """(vertices, 3) float32, rectified camera."""
    normals: FloatArray
    """(vertices, 3) float32, unit length, towards the camera."""
    vertex_status: ByteArray
    """(vertices,) uint8, PointStatus."""
    expected_error_mm: FloatArray
    """(vertices,) float32, root mean square of the 3D error to be expected: the root of the
    covariance's trace."""
    landmarks: RecordArray
    """(landmarks,) Landmark, of the template."""
    landmark_matches: RecordArray
    """(landmarks,) Match; weight 0: outlier."""
    patch_observations: RecordArray
    """(patches,) PatchObservation."""
    disparity: Optional[DisparityArray]
    """(height, width) int16, 1/16 px, DISPARITY_NONE: none; None unless the tracker has
    keep_disparity or grow."""
    times: Tuple[StageTime, ...]
    """In order of execution."""
    vertex_covariance: FloatArray
    """(vertices, 6) float32, xx, xy, xz, yy, yz, zz: covariance of the position's error, mm^2."""
    vertex_evidence: ByteArray
    """(vertices,) uint8, Evidence."""
    view_lag_frames: float
    """By how many frames the right view is late in this frame, negative: early; 0 where that cannot
    be measured."""
    vertical_offset_px: float
    """Of the right view against the left at the image centre, down is positive; mean of the last
    seconds."""
    roll_deg: float
    """Of the right view against the left about the image centre, clockwise is positive; mean of the
    last seconds."""
    focal_ratio: float
    """Right focal length to left; mean of the last seconds."""
    rig_matches: int
    """Between left and right view, behind the last three; 0: not measured."""
    template_epoch: int
    """Counts the tracker's templates, and how often tissue joined them; 0 without a template."""
    device_id: str
    """Of the device that computed the frame."""
    pieces: RecordArray
    """(pieces,) Piece, which pieces of the surface were found; none without a template."""
    body: BodyState
    """What carries points beneath the surface, now."""


def copy_result(r: structs.ResultStruct, size: Tuple[int, int]) -> Result:
    def array(address: Any, element: Any, *shape: int) -> Any:
        return copied(address, element, shape)

    width, height = size
    times = r.times[: min(r.time_count, MAX_TIMED_STAGES)]
    return Result(
        state=State(r.state),
        reasons=Reason(r.reasons),
        epoch=r.epoch,
        timestamp_ns=r.timestamp_ns,
        frame=r.frame,
        age=r.age,
        features=r.features,
        matches=r.matches,
        inliers=r.inliers,
        patches=r.patches,
        observed_share=r.observed_share,
        mean_residual_mm=r.mean_residual_mm,
        patch_residual_px=r.patch_residual_px,
        rigid_motion=array(ctypes.addressof(r.rigid_motion), "d", 3, 4),
        motions=array(r.motions, Motion, r.node_count),
        node_positions=array(r.node_positions, "f", r.node_count, 3),
        vertices=array(r.vertices, "f", r.vertex_count, 3),
        normals=array(r.normals, "f", r.vertex_count, 3),
        vertex_status=array(r.vertex_status, "B", r.vertex_count),
        expected_error_mm=array(r.expected_error_mm, "f", r.vertex_count),
        landmarks=array(r.landmarks, Landmark, r.landmark_count),
        landmark_matches=array(r.landmark_matches, Match, r.landmark_count),
        patch_observations=array(r.patch_observations, PatchObservation, r.patch_count),
        disparity=None if not r.disparity else array(r.disparity, "h", height, width),
        times=tuple(StageTime(text(time.name), time.milliseconds) for time in times),
        vertex_covariance=array(r.vertex_covariance, "f", r.vertex_count, 6),
        vertex_evidence=array(r.vertex_evidence, "B", r.vertex_count),
        view_lag_frames=r.view_lag_frames,
        vertical_offset_px=r.vertical_offset_px,
        roll_deg=r.roll_deg,
        focal_ratio=r.focal_ratio,
        rig_matches=r.rig_matches,
        template_epoch=r.template_epoch,
        device_id=text(r.device_id),
        pieces=array(r.pieces, Piece, r.piece_count),
        body=BodyState(r.body),
    )
