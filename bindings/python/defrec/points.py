"""What points and targets became in a frame; everything in it is a copy and outlives the job."""
from __future__ import annotations

from typing import NamedTuple

from ._arrays import ByteArray, FloatArray


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


class FixedPoints(NamedTuple):
    """Points in the fixed frame of a frame's camera_pose."""

    xyz: FloatArray
    """(n, 3) float64, mm."""
    covariance: FloatArray
    """(n, 6) float64, xx, xy, xz, yy, yz, zz of the error, mm^2, that of the pose added; the root
    of the trace is the expected error."""


class PointCovariances(NamedTuple):
    """How far off the positions of WarpedPoints may be, by direction, and what was observed
    there."""

    covariance: FloatArray
    """(n, 6) float64, xx, xy, xz, yy, yz, zz, mm^2, rectified camera; the root of the trace is the
    expected error."""
    evidence: ByteArray
    """(n,) uint8, Evidence."""
