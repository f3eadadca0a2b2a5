#!/usr/bin/env python3
"""Points at the time of display: follows pixels of the first left image, and says of each frame
where they are when it is shown.

display_points.py LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv DELAY_MS OUT.csv [DEVICE_ID]

POINTS.csv has the columns id,u,v (px). DELAY_MS, at most 100, is the time from when a frame was
taken to when the screen shows what is drawn for it. OUT.csv has the position of each point that
long after each frame, with the error to be expected then: mm, rectified left camera.
"""
from typing import Optional

import defrec
from input import Sequence, parse_camera, run
from track_folder import FollowedPoints, read_points

STATUS = {defrec.PointStatus.OBSERVED: "tracked", defrec.PointStatus.EXTRAPOLATED: "extrapolated"}


def main(
    left_folder: str,
    right_folder: str,
    camera: str,
    points_file: str,
    delay: str,
    out_file: str,
    device_id: Optional[str] = None,
) -> None:
    try:
        delay_ns = round(1e6 * float(delay))
    except (OverflowError, ValueError):
        raise ValueError(f"{delay} is no delay in ms") from None
    sequence = Sequence(left_folder, right_folder)
    points = read_points(points_file)

    with defrec.Context() as context, open(out_file, "w") as out:
        rig = defrec.Rig.rectified(context, sequence.width, sequence.height, parse_camera(camera))
        tracker = defrec.Tracker(context, rig, device_id, format=defrec.Format.RGB8)
        predictor = defrec.Predictor(len(points))
        print("frame,id,x,y,z,status,expected_error_mm", file=out)

        followed = FollowedPoints(rig, [(u, v) for _, u, v in points])
        for job in tracker.process(sequence):
            result = job.result()
            moved = followed.warp(job, result)
            # Every frame is told, also one that is lost: what came before it is no motion then.
            if moved is None:
                predictor.add_frame(result.timestamp_ns, state=defrec.State.INITIALISING)
            else:
                predictor.add_frame(
                    result.timestamp_ns,
                    moved.xyz,
                    moved.status,
                    moved.expected_error_mm,
                    state=result.state,
                    epoch=result.epoch,
                )
            # A live program asks when it draws, with the time at which the screen shows it.
            shown = predictor.predict(result.timestamp_ns + delay_ns)
            for i, (name, _, _) in enumerate(points):
                if shown.status[i] == defrec.PointStatus.UNKNOWN:
                    print(f"{result.frame},{name},,,,lost,", file=out)
                    continue
                x, y, z = shown.xyz[i]
                print(
                    f"{result.frame},{name},{x:.4f},{y:.4f},{z:.4f},{STATUS[shown.status[i]]},"
                    f"{shown.expected_error_mm[i]:.4f}",
                    file=out,
                )


if __name__ == "__main__":
    run(
        main,
        "display_points LEFT RIGHT FX,FY,CX,CY,BASELINE_MM POINTS.csv DELAY_MS OUT.csv [DEVICE_ID]",
        6,
        7,
    )
