"""Rigs: two calibrated cameras."""
from __future__ import annotations

import ctypes
from typing import Any, Callable, Optional, Tuple, Union

from . import structs
from ._arrays import ArrayLike, FloatArray, Points, address_of, copied, empty, flat
from ._handle import Handle
from ._library import native
from .context import Context
from .structs import Camera, Intrinsics


class Rig(Handle):
    """Two calibrated cameras, as OpenCV's stereoCalibrate gives them.

    width, height: of the raw images, px, 64 x 48 to 8192 x 8192.
    M1, M2: 3 x 3 camera matrices, px, without skew. D1, D2: 0, 4, 5, 8, 12 or 14 distortion
        coefficients in OpenCV's
    order, None: none.
    R (3 x 3), T (3, mm): x_right = R x_left + T; T[0] < 0 for a right camera on the right.

    Pixel (0, 0) is the centre of the top-left pixel. Cameras that are rectified already are used as
    they are. Raises ValueError for arrays of another size, Error for a calibration that cannot be
    (a baseline of 0, an R that is no rotation, ...). threads: any.
    """

    def __init__(
        self,
        context: Context,
        width: int,
        height: int,
        M1: ArrayLike,
        D1: Optional[ArrayLike],
        M2: ArrayLike,
        D2: Optional[ArrayLike],
        R: ArrayLike,
        T: ArrayLike,
    ) -> None:
        desc = structs.RigDesc(
            width=width,
            height=height,
            left=_intrinsics("M1", M1, "D1", D1),
            right=_intrinsics("M2", M2, "D2", D2),
        )
        desc.rotation[:] = flat("R", R, [9])
        desc.translation[:] = flat("T", T, [3])
        self._create(context, desc)

    def __repr__(self) -> str:
        closed = ", closed" if self.is_closed else ""
        return f"<Rig of {self._raw_size[0]}x{self._raw_size[1]} images{closed}>"

    @classmethod
    def rectified(cls, context: Context, width: int, height: int, camera: Camera) -> "Rig":
        """A pair whose images are rectified already: both views have this camera, the right one
        baseline_mm to the right, and its cx larger by disparity_offset_px."""
        if not isinstance(camera, Camera):
            raise TypeError(f"camera is a Camera, {camera!r} given")
        left, right = (
            [camera.fx, 0, camera.cx + offset, 0, camera.fy, camera.cy, 0, 0, 1]
            for offset in (0, camera.disparity_offset_px)
        )
        return cls(
            context,
            width,
            height,
            left,
            None,
            right,
            None,
            [1, 0, 0, 0, 1, 0, 0, 0, 1],
            [-camera.baseline_mm, 0, 0],
        )

    def _create(self, context: Context, desc: structs.RigDesc) -> None:
        if not isinstance(context, Context):
            raise TypeError(f"context is a Context, {context!r} given")
        handle, keep = context._open()
        super().__init__(
            lambda out: native.defrec_rig_create(handle, desc, out), native.defrec_rig_destroy, keep
        )
        self._raw_size = (desc.width, desc.height)
        self._info = structs.RigInfo()
        native.defrec_rig_get(self._native, self._info)

    @property
    def raw_size(self) -> Tuple[int, int]:
        """Width and height of the raw images, px."""
        return self._raw_size

    @property
    def size(self) -> Tuple[int, int]:
        """Width and height of the rectified images, px."""
        return self._info.width, self._info.height

    @property
    def camera(self) -> Camera:
        """Pinhole of the rectified images."""
        return Camera.from_buffer_copy(self._info.camera)

    @property
    def rotation(self) -> FloatArray:
        """(3, 3) float64: x_rectified = rotation x_left_raw."""
        made: FloatArray = copied(ctypes.addressof(self._info.rotation), "d", (3, 3))
        return made

    @property
    def is_identity(self) -> bool:
        """Frames are rectified already and not resampled."""
        return bool(self._info.identity)

    def rectify_pixels(self, raw_uv: ArrayLike) -> FloatArray:
        """Maps (n, 2) pixels of the raw left image to the rectified left image; NaN where there is
        no answer. threads: any"""
        return self._rectify_pixels("raw_uv", raw_uv)

    def distort_pixels(self, rectified_uv: ArrayLike) -> FloatArray:
        """Maps (n, 2) pixels of the rectified left image to the raw left image; NaN where there is
        no answer. threads: any"""
        return self._map("rectified_uv", rectified_uv, native.defrec_rig_distort_pixels)

    def _rectify_pixels(self, name: str, uv: ArrayLike) -> FloatArray:
        return self._map(name, uv, native.defrec_rig_rectify_pixels)

    def _map(self, name: str, value: ArrayLike, function: Callable[..., Any]) -> FloatArray:
        given = Points(name, value, 2)
        made: FloatArray = empty("d", (given.count, 2))
        function(self._native, given.address, given.count, address_of(made))
        return made


def _intrinsics(
    matrix_name: str, matrix: ArrayLike, distortion_name: str, distortion: Optional[ArrayLike]
) -> Intrinsics:
    m = flat(matrix_name, matrix, [9])
    if m[1] != 0 or m[3] != 0 or m[6:] != [0, 0, 1]:
        raise ValueError(f"{matrix_name} is {m}, fx 0 cx, 0 fy cy, 0 0 1 expected")
    d = [] if distortion is None else flat(distortion_name, distortion, [0, 4, 5, 8, 12, 14])
    made = Intrinsics(fx=m[0], fy=m[4], cx=m[2], cy=m[5], distortion_count=len(d))
    made.distortion[: len(d)] = d
    return made
