#!/usr/bin/env python3
"""From the scan to the tissue: registers a preoperative model to the template, once, and follows
its targets through a stereo sequence.

scan_to_tissue.py LEFT RIGHT FX,FY,CX,CY,BASELINE_MM SCAN.obj LANDMARKS.csv TARGETS.csv OUT.csv
    [DEVICE_ID]

SCAN.obj is the organ's surface as the scan has it (CT, say), mm. LANDMARKS.csv has the columns
x,y,z,u,v: three or more places of the scan, and the pixels of the first left image where somebody
saw them, which therefore has to show the surface. TARGETS.csv has the columns id,x,y,z, in the
scan's frame. OUT.csv has their positions in each frame, rectified left camera, with the error to be
expected: that of the registration and that of tracking together. A registration that cannot be
trusted ends the program, with the reason; a person has to look.
"""
import csv
from typing import List, Optional, TextIO, Tuple

import numpy
from numpy.typing import NDArray

import defrec
from input import Sequence, is_given_up, parse_camera, run, wait_for_body
from mesh import read_obj

LANDMARK_ERROR_MM = 1.0  # they are clicked, so they are not exact
Table = NDArray[numpy.float64]


def read_table(path: str, header: str) -> Table:
    """Rows of numbers, below the header."""
    names = header.split(",")
    with open(path, newline="") as file:
        reader = csv.reader(file)
        if next(reader, None) != names:
            raise ValueError(f"{path}: the header {header} expected")
        try:
            rows = [[float(cell) for cell in row] for row in reader]
        except ValueError:
            raise ValueError(f"{path}: numbers expected below the header") from None
    if not all(len(row) == len(names) for row in rows):
        raise ValueError(f"{path}: {len(names)} numbers expected in each row")
    return numpy.array(rows, numpy.float64).reshape(-1, len(names))


def start_by_landmarks(rig: defrec.Rig, template: defrec.Template, path: str) -> Table:
    """About where the scan lies, (3, 4)."""
    landmarks = read_table(path, "x,y,z,u,v")
    lifted = template.lift(rig.rectify_pixels(landmarks[:, 3:]))
    used = lifted.found  # the template has no surface under the others
    if used.sum() < 3:
        raise ValueError(f"{used.sum()} landmarks lie on the template, three or more expected")
    variance = LANDMARK_ERROR_MM**2
    errors = numpy.tile([variance, 0, 0, variance, 0, variance], (used.sum(), 1))
    with defrec.Registration.from_pairs(
        landmarks[used, :3], lifted.xyz[used], seen_covariance=errors
    ) as registration:
        found = registration.result()
    print(f"landmarks: {found.reason}")
    if found.verdict not in (defrec.Verdict.ACCEPTED, defrec.Verdict.UNDETERMINED):
        raise ValueError(f"the landmarks give no start: {found.reason}")
    return found.transform


def register_scan(
    context: defrec.Context, template: defrec.Template, scan_file: str, start: Table
) -> defrec.Registration:
    """By the surface, which says much more."""
    vertices, triangles = read_obj(scan_file)
    # The landmarks are not farther off.
    registration = defrec.Registration.from_template(
        context, template, (vertices, triangles), start=start, max_shift_mm=10, max_turn_rad=0.2
    )
    found = registration.result()
    print(f"surface: {found.reason}")
    for motion in found.free_motions:
        print(f"not determined: {motion.text}")
    if found.verdict != defrec.Verdict.ACCEPTED:
        registration.close()
        raise ValueError(f"the scan is not registered: {found.reason}")
    return registration


def make_plan(
    context: defrec.Context,
    rig: defrec.Rig,
    job: defrec.Job,
    files: Tuple[str, str],
    targets: Table,
) -> defrec.Plan:
    """job: of the first frame. files: of the scan and of the landmarks. targets: (n, 3), scan
    frame."""
    # The landmarks are its pixels: tissue is elsewhere in a later image.
    if len(job.result().vertices) == 0:
        raise ValueError(
            "the landmarks are pixels of the first image, which shows no surface; begin where one "
            "is seen"
        )
    scan_file, landmarks_file = files
    with job.template() as template:
        start = start_by_landmarks(rig, template, landmarks_file)
        with register_scan(context, template, scan_file, start) as registration:
            plan = defrec.Plan(template, registration, targets=targets)
        wait_for_body(template)
        return plan


def write_rows(
    file: TextIO, frame: int, ids: List[int], moved: Optional[defrec.MovedTargets]
) -> None:
    """moved: None where nothing is known."""
    if moved is None:
        for name in ids:
            print(f"{frame},{name},,,,lost,", file=file)
        return
    for name, (x, y, z), status, error in zip(
        ids, moved.xyz, moved.status, moved.expected_error_mm
    ):
        if status == defrec.PointStatus.UNKNOWN:
            print(f"{frame},{name},,,,lost,", file=file)
            continue
        word = "tracked" if status == defrec.PointStatus.OBSERVED else "extrapolated"
        print(f"{frame},{name},{x:.4f},{y:.4f},{z:.4f},{word},{error:.4f}", file=file)


def main(
    left_folder: str,
    right_folder: str,
    camera: str,
    scan_file: str,
    landmarks_file: str,
    targets_file: str,
    out_file: str,
    device_id: Optional[str] = None,
) -> None:
    sequence = Sequence(left_folder, right_folder)
    targets = read_table(targets_file, "id,x,y,z")
    ids = [int(each) for each in targets[:, 0]]
    with defrec.Context() as context, open(out_file, "w") as out:
        rig = defrec.Rig.rectified(context, sequence.width, sequence.height, parse_camera(camera))
        # Without a device id, the fastest is used.
        tracker = defrec.Tracker(context, rig, device_id, format=defrec.Format.RGB8)
        print("frame,id,x,y,z,status,expected_error_mm", file=out)
        plan = None
        is_void = False  # the template of the plan was given up
        for frame, job in enumerate(tracker.process(sequence)):
            if plan is None:
                plan = make_plan(context, rig, job, (scan_file, landmarks_file), targets[:, 1:])
            is_void = is_void or is_given_up(job.result())
            write_rows(out, frame, ids, None if is_void else job.move_plan(plan))


if __name__ == "__main__":
    run(
        main,
        "scan_to_tissue LEFT RIGHT FX,FY,CX,CY,BASELINE_MM SCAN.obj LANDMARKS.csv TARGETS.csv "
        "OUT.csv [DEVICE_ID]",
        7,
        8,
    )
