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
    r"^[ ]*{name}:\s*!!opencv-matrix\s*rows:\s*\d+\s*cols:\s*\d+\s*"
    r"dt:\s*[df]\s*data:\s*\[([^\]]*)\]"
)


@dataclass(frozen=True)
class Calibration:
    """Two cameras as OpenCV's stereoCalibrate gives them; see Rig for shapes. T in mm."""

    M1: ArrayLike
    D1: Optional[ArrayLike]
    M2: ArrayLike
    D2: Optional[ArrayLike]
    R: ArrayLike
    T: ArrayLike

    @classmethod
    def load(cls, path: Union[str, "os.PathLike[str]"]) -> "Calibration":
        """Reads M1 D1 M2 D2 R T of a YAML file that cv2.FileStorage wrote. Raises OSError, and
        ValueError for what is missing."""
        with open(path, encoding="utf-8") as file:
            text = file.read()
        found: Dict[str, Any] = {}
        for name in ("M1", "D1", "M2", "D2", "R", "T"):
            matrix = re.search(_MATRIX.format(name=name), text, re.MULTILINE)
            if matrix is None:
                raise ValueError(
                    f"{os.fspath(path)}: no matrix {name}; OpenCV's YAML with M1 D1 M2 D2 R T"
                    " expected"
                )
            found[name] = [float(number) for number in matrix[1].split(",")]
        return cls(**found)

    def rig(self, context: Context, width: int, height: int) -> Rig:
        """The two cameras, for images of this size. Raises what Rig raises."""
        return Rig(context, width, height, self.M1, self.D1, self.M2, self.D2, self.R, self.T)


CalibrationLike = Union[Calibration, Camera, Mapping[str, Any], str, "os.PathLike[str]"]
"""A Calibration, or the Camera of rectified images; a mapping with M1 D1 M2 D2 R T, or a file with
them."""


def rig_of(context: Context, calibration: CalibrationLike, width: int, height: int) -> Rig:
    if isinstance(calibration, Camera):
        return Rig.rectified(context, width, height, calibration)
    if isinstance(calibration, Mapping):
        names = ("M1", "D1", "M2", "D2", "R", "T")
        missing = [name for name in names if name not in calibration]
        if missing:
            raise ValueError(f"calibration has no {', '.join(missing)}; M1 D1 M2 D2 R T expected")
        calibration = Calibration(**{name: calibration[name] for name in names})
    elif not isinstance(calibration, Calibration):
        calibration = Calibration.load(calibration)
    return calibration.rig(context, width, height)
