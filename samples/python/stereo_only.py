#!/usr/bin/env python3
"""A single stage: the disparity of a rectified pair of images.

stereo_only.py LEFT.png RIGHT.png OUT.pgm [DEVICE_ID]

OUT.pgm has 16 bits a pixel: disparity in 1/16 px, 0 where there is none.
"""
from typing import Optional

import numpy

import defrec
from input import read_gray, run


def main(left_file: str, right_file: str, out_file: str, device_id: Optional[str] = None) -> None:
    left, right = read_gray(left_file), read_gray(right_file)
    height, width = left.shape
    with defrec.Context() as context:
        # Parameters that are not named have their default.
        stereo = defrec.StereoStage(
            context, defrec.StereoParams(width=width, height=height), device_id
        )
        disparity, _ = stereo.run(left, right)
    shown = numpy.where(disparity == defrec.DISPARITY_NONE, 0, disparity)
    with open(out_file, "wb") as file:
        file.write(b"P5\n%d %d\n65535\n" % (width, height))
        file.write(shown.astype(">u2").tobytes())  # the most significant byte first


if __name__ == "__main__":
    run(main, "stereo_only LEFT.png RIGHT.png OUT.pgm [DEVICE_ID]", 3, 4)
