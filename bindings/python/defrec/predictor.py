"""Points at the time of display: where they are shortly after the last frame."""
from __future__ import annotations

import ctypes
from typing import NamedTuple, Optional

from . import structs
from ._arrays import ArrayLike, ByteArray, FloatArray, Points, address_of, column, empty
from ._handle import Handle
from ._library import native
from ._struct import fitting
from .enums import State


class PredictedPoints(NamedTuple):
    """Points at a time after the last frame."""

    xyz: FloatArray
    """(n, 3) float64, mm, in the frame of reference of what was added."""
    status: ByteArray
    """(n,) uint8, PointStatus, that of the last frame."""
    expected_error_mm: FloatArray
    """(n,) float64, root mean square of the 3D error to be expected: that of the last frame, and
    never less later."""
    basis: ByteArray
    """(n,) uint8, PredictionBasis: what each prediction rests on."""


class Predictor(Handle):
    """Places of points when a frame is shown, from how they moved in the frames until then.

    count: how many points, 1 to 1,000,000; the same ones in all frames. Add every frame, then ask.
    threads: any. Raises Error.
    """

    def __init__(self, count: int) -> None:
        desc = structs.PredictorDesc(point_count=count)
        super().__init__(
            lambda out: native.defrec_predictor_create(desc, out), native.defrec_predictor_destroy
        )
        self._count = int(count)

    def add_frame(
        self,
        timestamp_ns: int,
        xyz: Optional[ArrayLike] = None,
        status: Optional[ArrayLike] = None,
        expected_error_mm: Optional[ArrayLike] = None,
        *,
        state: int = State.TRACKING,
        epoch: int = 0,
    ) -> None:
        """Tells where the points were in a frame: what Job.warp_points, Job.move_targets or
        Job.move_plan gave, with timestamp_ns, state and epoch of its Result. Each frame, in the
        order of time, also those that are lost.

        xyz: (n, 3), mm. status: n of PointStatus. Both may be None in a frame that is lost or has
        no template. expected_error_mm: n; None: 0. Motion before a frame that is lost, has no
        template or another epoch, or comes after a gap, is forgotten; so is that of a point before
        it was unknown, or jumped. threads: any. Raises Error, with Status.ERROR_ARGUMENT where the
        time does not grow or a number is not finite; the predictor stays as it was."""
        frame = structs.PredictorFrame(
            state=state, epoch=epoch, timestamp_ns=timestamp_ns, count=self._count
        )
        given = {
            "xyz": None if xyz is None else Points("xyz", xyz, 3),
            "status": None if status is None else column("status", status, "B"),
            "expected_error_mm": None
            if expected_error_mm is None
            else column("expected_error_mm", expected_error_mm),
        }
        for name, points in given.items():
            if points is None:
                continue
            if points.count != self._count:
                raise ValueError(f"{name} has {points.count} rows, {self._count} expected")
            setattr(frame, name, points.address)
        native.defrec_predictor_add_frame(self._native, frame)

    def predict(self, timestamp_ns: int) -> PredictedPoints:
        """Places of the points at a time from that of the last frame to MAX_PREDICTION_MS after it,
        of the same clock.

        A point that is unknown in the last frame stays so. threads: any. Raises Error, with
        Status.ERROR_STATE where no frame was added yet, and Status.ERROR_ARGUMENT for another time:
        show then that the points are not known."""
        time = fitting("timestamp_ns", timestamp_ns, ctypes.c_int64)
        n = self._count
        xyz, status, errors = empty("d", (n, 3)), empty("B", (n,)), empty("d", (n,))
        basis = empty("B", (n,))
        native.defrec_predictor_predict(
            self._native,
            time,
            n,
            address_of(xyz),
            address_of(status),
            address_of(errors),
            address_of(basis),
        )
        return PredictedPoints(xyz, status, errors, basis)

    def __len__(self) -> int:
        return self._count

    def __bool__(self) -> bool:
        return True

    def __repr__(self) -> str:
        return f"<Predictor, {self._count}{', closed' if self.is_closed else ''}>"
