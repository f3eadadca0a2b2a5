#!/usr/bin/env python3
"""Disparity from outside: follows pixels of the first left image on the disparity of a stereo
network, a depth camera or another matcher, in place of defrec's own.

given_disparity.py LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DISPARITY SIGMA POINTS.csv OUT.csv [DEVICE_ID]

DISPARITY is a folder with a PFM file for each image, in the order of their names: px of the
rectified left image; 0, inf or NaN where there is none. SIGMA is the standard deviation of the
error that a pixel shares with those around it: a number of px for all of them, or a folder of PFM
files with that of each pixel. POINTS.csv has the columns id,u,v (px). OUT.csv has the position of
each point in each frame: mm, rectified left camera.
"""
import pathlib
import re
from typing import List, Optional, Union

import numpy
from numpy.typing import NDArray

import defrec
from input import Sequence, parse_camera, run
from track_folder import FollowedPoints, read_points

STATUS = {defrec.PointStatus.OBSERVED: "tracked", defrec.PointStatus.EXTRAPOLATED: "extrapolated"}
Map = NDArray[numpy.float32]


def read_pfm(path: pathlib.Path, sequence: Sequence) -> Map:
    """(height, width) float32, rows from the top; what is not finite is 0. The rectified image has
    the size of those of the sequence."""
    with open(path, "rb") as file:
        header = re.match(rb"Pf\s+(\d+)\s+(\d+)\s+(\S+)\s", file.read(64))
        if header is None:
            raise ValueError(f"{path}: a PFM of one channel expected")
        width, height, scale = int(header[1]), int(header[2]), float(header[3])
        file.seek(header.end())
        values = file.read(4 * width * height)
    if (width, height) != (sequence.width, sequence.height):
        raise ValueError(
            f"{path}: is {width}x{height}, the rectified image is"
            f" {sequence.width}x{sequence.height}"
        )
    if len(values) != 4 * width * height:
        raise ValueError(f"{path}: is cut off")
    rows = numpy.frombuffer(values, "<f4" if scale < 0 else ">f4").reshape(height, width)
    upright = rows[::-1].astype(numpy.float32)  # the last row comes first
    return numpy.where(numpy.isfinite(upright), upright, numpy.float32(0))


def map_files(folder: str, frames: int) -> List[pathlib.Path]:
    files = sorted(path for path in pathlib.Path(folder).iterdir() if path.suffix == ".pfm")
    if len(files) != frames:
        raise ValueError(f"{folder} has {len(files)} PFM files, but there are {frames} frames")
    return files


class DisparitySource:
    """Where the disparity comes from. A live program has its network's output here."""

    def __init__(self, folder: str, sigma: str, sequence: Sequence) -> None:
        self._sequence = sequence
        self._files = map_files(folder, len(sequence))
        self._sigma: Union[float, List[pathlib.Path]]
        try:
            self._sigma = float(sigma)
        except ValueError:
            self._sigma = map_files(sigma, len(sequence))

    def disparity(self, frame: int) -> Map:
        return read_pfm(self._files[frame], self._sequence)

    def sigma(self, frame: int) -> Union[float, Map]:
        if isinstance(self._sigma, float):
            return self._sigma
        return read_pfm(self._sigma[frame], self._sequence)


def main(
    left_folder: str,
    right_folder: str,
    camera: str,
    disparity_folder: str,
    sigma: str,
    points_file: str,
    out_file: str,
    device_id: Optional[str] = None,
) -> None:
    sequence = Sequence(left_folder, right_folder)
    points = read_points(points_file)
    source = DisparitySource(disparity_folder, sigma, sequence)

    with defrec.Context() as context, open(out_file, "w") as out:
        rig = defrec.Rig.rectified(context, sequence.width, sequence.height, parse_camera(camera))
        tracker = defrec.Tracker(context, rig, device_id, format=defrec.Format.RGB8)
        print("frame,id,x,y,z,status,expected_error_mm", file=out)

        followed = FollowedPoints(rig, [(u, v) for _, u, v in points])
        contradicted = 0
        for frame, (left, right, timestamp_ns) in enumerate(sequence):
            # The right image stays required: the disparity is compared with both.
            with tracker.submit(
                left,
                right,
                timestamp_ns,
                disparity=source.disparity(frame),
                disparity_sigma=source.sigma(frame),
            ) as job:
                result = job.result()
                # Another unit, another frame or another rectification: do not go on unnoticed.
                contradicted += bool(result.reasons & defrec.Reason.DISPARITY)
                moved = followed.warp(job, result)
            for i, (name, _, _) in enumerate(points):
                status = None if moved is None else STATUS.get(moved.status[i])
                if moved is None or status is None:
                    print(f"{frame},{name},,,,lost,", file=out)
                    continue
                x, y, z = moved.xyz[i]
                error = moved.expected_error_mm[i]
                print(f"{frame},{name},{x:.4f},{y:.4f},{z:.4f},{status},{error:.4f}", file=out)
    print(f"{len(sequence)} frames, in {contradicted} of them the images contradict the disparity")


if __name__ == "__main__":
    run(
        main,
        "given_disparity LEFT RIGHT FX,FY,CX,CY,BASELINE_MM DISPARITY SIGMA POINTS.csv OUT.csv "
        "[DEVICE_ID]",
        7,
        8,
    )
