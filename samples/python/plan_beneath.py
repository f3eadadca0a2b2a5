#!/usr/bin/env python3
"""A plan beneath the surface: follows its targets (a tumour's margin, a vessel) through a stereo
sequence, and draws them over the left image with a ring of the expected error.

plan_beneath.py LEFT RIGHT FX,FY,CX,CY,BASELINE_MM TARGETS.csv OUT_FOLDER [DEVICE_ID]

TARGETS.csv has the columns id,x,y,z, and may have others: mm, template frame (the rectified left
camera of the frame that became the template; an application registers its plan to that).
OUT_FOLDER/targets.csv has the position of each target in each frame: mm, rectified left camera.
OUT_FOLDER/000000.ppm and so on are the left images with the targets: a dot where each is, and a
ring as wide as the error to be expected there, of at least 3 px. Green ones lie on the surface and
were observed; those that the tissue carries are orange.
"""
import csv
import pathlib
from typing import List, Optional, TextIO, Tuple

import numpy
from numpy.typing import NDArray

import defrec
from input import Image8, Sequence, is_given_up, parse_camera, run, wait_for_body

OBSERVED, CARRIED = (64, 220, 96), (255, 176, 32)


def read_plan(path: str) -> Tuple[List[str], NDArray[numpy.float64]]:
    """Ids, and (n, 3) positions."""
    with open(path, newline="") as file:
        try:
            rows = [
                (row["id"], [float(row[axis]) for axis in "xyz"]) for row in csv.DictReader(file)
            ]
        except (KeyError, TypeError, ValueError):
            raise ValueError(f"{path}: the columns id,x,y,z expected") from None
    if not rows:
        raise ValueError(f"{path}: names no target")
    return [name for name, _ in rows], numpy.array([xyz for _, xyz in rows])


def prepare(job: defrec.Job, xyz: NDArray[numpy.float64]) -> defrec.Targets:
    """The targets, prepared for the job's template."""
    with job.template() as template:
        wait_for_body(template)
        return defrec.Targets(template, xyz)


def write_rows(
    file: TextIO, frame: int, names: List[str], moved: Optional[defrec.MovedTargets]
) -> None:
    for i, name in enumerate(names):
        if moved is None or moved.status[i] == defrec.PointStatus.UNKNOWN:
            print(f"{frame},{name},,,,lost,", file=file)
        else:
            x, y, z = moved.xyz[i]
            observed = moved.status[i] == defrec.PointStatus.OBSERVED
            status = "tracked" if observed else "extrapolated"
            error = moved.expected_error_mm[i]
            print(f"{frame},{name},{x:.4f},{y:.4f},{z:.4f},{status},{error:.4f}", file=file)


def print_frame(
    frame: int, names: List[str], moved: Optional[defrec.MovedTargets], body: defrec.BodyState
) -> None:
    errors = (
        numpy.zeros(0)
        if moved is None
        else moved.expected_error_mm[moved.status != defrec.PointStatus.UNKNOWN]
    )
    most = errors.max(initial=0)
    print(
        f"frame {frame}: body {body.name.lower()}, {len(errors)} of {len(names)} targets, "
        f"expected error up to {most:.4f} mm"
    )


def draw(picture: Image8, moved: defrec.MovedTargets, camera: defrec.Camera) -> None:
    height, width, _ = picture.shape
    for (x, y, z), status, error in zip(moved.xyz, moved.status, moved.expected_error_mm):
        if status == defrec.PointStatus.UNKNOWN or not z > 0:
            continue
        u, v = camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy
        radius = camera.fx * error / z
        if 0 <= u < width and 0 <= v < height and radius < 8192:
            colour = OBSERVED if status == defrec.PointStatus.OBSERVED else CARRIED
            column, row, wide = (int(16 * px + 0.5) for px in (u, v, radius))
            draw_target(picture, column, row, max(wide, 3 * 16), colour)


def draw_target(picture: Image8, u: int, v: int, radius: int, colour: Tuple[int, int, int]) -> None:
    """A dot and a ring; centre and radius in 1/16 px."""
    dot, half_line = 24, 12
    reach = max(radius + half_line, dot) // 16 + 1
    top, left = max(v // 16 - reach, 0), max(u // 16 - reach, 0)
    part = picture[top : v // 16 + reach + 1, left : u // 16 + reach + 1]
    y, x = numpy.ogrid[top : top + part.shape[0], left : left + part.shape[1]]
    squared = (16 * x - u) ** 2 + (16 * y - v) ** 2
    ring = (squared >= (radius - half_line) ** 2) & (squared <= (radius + half_line) ** 2)
    part[(squared <= dot**2) | ring] = colour


def main(
    left_folder: str,
    right_folder: str,
    camera_text: str,
    targets_file: str,
    out_folder: str,
    device_id: Optional[str] = None,
) -> None:
    sequence = Sequence(left_folder, right_folder)
    names, plan = read_plan(targets_file)
    camera = parse_camera(camera_text)
    folder = pathlib.Path(out_folder)
    folder.mkdir(exist_ok=True)

    with defrec.Context() as context, open(folder / "targets.csv", "w") as out:
        rig = defrec.Rig.rectified(context, sequence.width, sequence.height, camera)
        # Without a device id, the fastest is used.
        tracker = defrec.Tracker(context, rig, device_id, format=defrec.Format.RGB8)
        print("frame,id,x,y,z,status,expected_error_mm", file=out)

        targets = None
        is_void = False  # the template of the targets was given up
        for frame, job in enumerate(tracker.process(sequence)):
            if targets is None and len(job.result().vertices) > 0:  # there is a template
                targets = prepare(job, plan)
            is_void = is_void or (targets is not None and is_given_up(job.result()))
            moved = None if targets is None or is_void else job.move_targets(targets)
            write_rows(out, frame, names, moved)
            picture = sequence[frame][0].copy()
            if moved is not None:
                draw(picture, moved, camera)
            with open(folder / f"{frame:06}.ppm", "wb") as file:
                file.write(b"P6\n%d %d\n255\n" % (sequence.width, sequence.height))
                file.write(picture.tobytes())
            print_frame(frame, names, moved, job.result().body)


if __name__ == "__main__":
    run(
        main,
        "plan_beneath LEFT RIGHT FX,FY,CX,CY,BASELINE_MM TARGETS.csv OUT_FOLDER [DEVICE_ID]",
        5,
        6,
    )
