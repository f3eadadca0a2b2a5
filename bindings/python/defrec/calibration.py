"""Calibrations of two cameras, from a file of OpenCV or from its arrays."""
from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import Any, Dict, Mapping, Optional, Union

from ._arrays import ArrayLike
from .context import Context
from .rig import Rig
from .structs import Camera

_MATRIX = (
    r"^[ ]*(?:{name}):\s*!!opencv-matrix\s*rows:\s*\d+\s*cols:\s*\d+\s*"
    r"dt:\s*[df]\s*data:\s*\[([^\]]*)\]"
)
_MATRICES = {
    "M1": "M1|K1|cameraMatrix1",
    "D1": "D1|distCoeffs1",
    "M2": "M2|K2|cameraMatrix2",
    "D2": "D2|distCoeffs2",
    "R": "R",
    "T": "T",
}
_SIZE = ("image_width", "image_height")


@dataclass(frozen=True)
class Calibration:
    """Two cameras as OpenCV's stereoCalibrate gives them; see Rig for shapes. T in mm. No rig is
    made for images of another size than image_width x image_height, where these are given."""

    M1: ArrayLike
    D1: Optional[ArrayLike]
    M2: ArrayLike
    D2: Optional[ArrayLike]
    R: ArrayLike
    T: ArrayLike
    image_width: Optional[int] = None
    image_height: Optional[int] = None

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"]) -> "Calibration":
        """Reads M1 D1 M2 D2 R T, and image_width image_height where they are there, of a YAML file
        that cv2.FileStorage wrote; K1 or cameraMatrix1 is M1, distCoeffs1 is D1. Raises OSError,
        and ValueError for what is missing."""
        with open(path, encoding="utf-8") as file:
            text = file.read()
        found: Dict[str, Any] = {}
        for name, names in _MATRICES.items():
            matrix = re.search(_MATRIX.format(name=names), text, re.MULTILINE)
            if matrix is None:
                raise ValueError(
                    f"{os.fspath(path)}: no matrix {name}; OpenCV's YAML with M1 D1 M2 D2 R T"
                    " expected"
                )
            found[name] = [float(number) for number in matrix[1].split(",")]
        for name in _SIZE:
            size = re.search(rf"^[ ]*{name}:\s*(\d+)\s*$", text, re.MULTILINE)
            found[name] = None if size is None else int(size[1])
        return cls(**found)

    def rig(self, context: Context, width: int, height: int) -> Rig:
        """The two cameras, for images of this size. Raises what Rig raises, and ValueError where
        the calibration is of images of another size."""
        size = (self.image_width or width, self.image_height or height)
        if size != (width, height):
            raise ValueError(
                f"the calibration is for {size[0]}x{size[1]} px but the frames are"
                f" {width}x{height} px; nothing is scaled silently, so calibrate for this size or"
                " resize the frames"
            )
        return Rig(context, width, height, self.M1, self.D1, self.M2, self.D2, self.R, self.T)


CalibrationLike = Union[Calibration, Camera, Mapping[str, Any], str, "os.PathLike[str]"]
"""A Calibration, or the Camera of rectified images; a mapping with M1 D1 M2 D2 R T and, where they
are known, image_width image_height, or a file with them."""


def rig_of(context: Context, calibration: CalibrationLike, width: int, height: int) -> Rig:
    if isinstance(calibration, Camera):
        return Rig.rectified(context, width, height, calibration)
    if isinstance(calibration, Mapping):
        missing = [name for name in _MATRICES if name not in calibration]
        if missing:
            raise ValueError(f"calibration has no {', '.join(missing)}; M1 D1 M2 D2 R T expected")
        given = (name for name in (*_MATRICES, *_SIZE) if name in calibration)
        calibration = Calibration(**{name: calibration[name] for name in given})
    elif not isinstance(calibration, Calibration):
        calibration = Calibration.load(calibration)
    return calibration.rig(context, width, height)
