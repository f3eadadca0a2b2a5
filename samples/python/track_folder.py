#!/usr/bin/env python3
"""Follows pixels of the first left image through a stereo sequence.

track_folder.py LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv [DEVICE_ID]

POINTS.csv has the columns id,u,v (px). OUT.csv has the position of each point in each frame: mm,
rectified left camera.
"""
import csv
from typing import List, Optional, Tuple

import defrec
from input import Sequence, parse_camera, run, wait_for_body


def read_points(path: str) -> List[Tuple[str, float, float]]:
    """Id, u and v of each line."""
    with open(path, newline="") as file:
        try:
            points = [(row["id"], float(row["u"]), float(row["v"])) for row in csv.DictReader(file)]
        except (KeyError, TypeError, ValueError):
            raise ValueError(f"{path}: the columns id,u,v expected") from None
    if not points:
        raise ValueError(f"{path}: names no point")
    return points


class FollowedPoints:
    """Pixels of the first left image, and the points of the surface under them."""

    def __init__(self, rig: defrec.Rig, pixels: List[Tuple[float, float]]) -> None:
        self._pixels = rig.rectify_pixels(pixels)
        self._lifted: Optional[defrec.Lifted] = None
        self._is_looked_up = False

    def warp(self, job: defrec.Job, result: defrec.Result) -> Optional[defrec.WarpedPoints]:
        """Where they are in the job's frame, unknown where the template has no surface; None
        without a template. To be called of every frame, from the first on."""
        has_surface = len(result.vertices) > 0
        # The pixels are of the first image: tissue is elsewhere in a later one. What was found on
        # a template that is given up says nothing of the next one.
        if not has_surface:
            self._lifted = None
        elif not self._is_looked_up:
            with job.template() as surface:  # the tracker's may be that of a later frame
                wait_for_body(surface)
                self._lifted = surface.lift(self._pixels)
        self._is_looked_up = True
        if self._lifted is None:
            return None
        moved = job.warp_points(self._lifted.xyz)
        moved.status[~self._lifted.found] = defrec.PointStatus.UNKNOWN
        return moved


def main(
    left_folder: str,
    right_folder: str,
    camera: str,
    points_file: str,
    out_file: str,
    device_id: Optional[str] = None,
) -> None:
    sequence = Sequence(left_folder, right_folder)
    points = read_points(points_file)

    with defrec.Context() as context, open(out_file, "w") as out:
        rig = defrec.Rig.rectified(context, sequence.width, sequence.height, parse_camera(camera))
        # Without a device id, the fastest is used.
        tracker = defrec.Tracker(context, rig, device_id, format=defrec.Format.RGB8)
        print("frame,id,x,y,z,status,expected_error_mm", file=out)

        followed = FollowedPoints(rig, [(u, v) for _, u, v in points])
        for job in tracker.process(sequence):  # later frames are computed meanwhile
            result = job.result()
            moved = followed.warp(job, result)
            for i, (name, _, _) in enumerate(points):
                if moved is None or moved.status[i] == defrec.PointStatus.UNKNOWN:
                    print(f"{result.frame},{name},,,,lost,", file=out)
                else:
                    x, y, z = moved.xyz[i]
                    error = moved.expected_error_mm[i]
                    status = (
                        "tracked"
                        if moved.status[i] == defrec.PointStatus.OBSERVED
                        else "extrapolated"
                    )
                    print(
                        f"{result.frame},{name},{x:.4f},{y:.4f},{z:.4f},{status},{error:.4f}",
                        file=out,
                    )


if __name__ == "__main__":
    run(
        main, "track_folder LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv OUT.csv [DEVICE_ID]", 5, 6
    )
