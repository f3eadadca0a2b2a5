"""A real track of a reference sequence: its points equal those that `defrec track` wrote, digit for digit.

SEQUENCE and TRACKED, from the environment: what `defrec render` wrote and what `defrec track` made of it.
"""
import csv
import math
import os
import pathlib
import re
import unittest

from PIL import Image

from defrec import Context, Format, PointStatus, Rig, Tracker
from defrec._arrays import numpy

SEQUENCE, TRACKED = (pathlib.Path(os.environ[name]) for name in ("SEQUENCE", "TRACKED"))
COVARIANCE = ["xx", "xy", "xz", "yy", "yz", "zz"]
COLUMNS = ["frame", "id", "x", "y", "z", "status", "expected_error_mm", *COVARIANCE, "evidence"]
EVIDENCE = ["none", "depth", "lateral", "both"]


def calibration():
    text = (SEQUENCE / "calibration.yaml").read_text()
    found = {}
    for name in ("M1", "D1", "M2", "D2", "R", "T"):
        data = re.search(rf"^{name}:.*?data: \[(.*?)\]", text, re.DOTALL | re.MULTILINE)[1]
        found[name] = [float(number) for number in data.split(",")]
        if name in ("M1", "M2", "R") and numpy is not None:
            found[name] = numpy.array(found[name]).reshape(3, 3)
    return found


def read(path):
    image = Image.open(path).convert("RGB")
    return image.tobytes() if numpy is None else numpy.asarray(image)


def frames():
    lefts, rights = (sorted((SEQUENCE / view).iterdir()) for view in ("left", "right"))
    for index, (left, right) in enumerate(zip(lefts, rights)):
        yield read(left), read(right), index * 1_000_000_000 // 30


class Track(unittest.TestCase):
    def test_points_equal_those_of_defrec_track(self):
        with open(SEQUENCE / "points.csv", newline="") as file:
            points = [(row["id"], float(row["u"]), float(row["v"])) for row in csv.DictReader(file)]
        rows = []
        with Context() as context, Rig(context, 320, 240, **calibration()) as rig:
            with Tracker(context, rig, "cpu", format=Format.RGB8) as tracker:
                lifted = None
                for job in tracker.process(frames()):
                    result = job.result()
                    if lifted is None and len(result.vertices) > 0:
                        lifted = tracker.template().lift(rig.rectify_pixels([(u, v) for _, u, v in points]))
                    moved = job.warp_points(lifted.xyz)
                    errors = job.point_covariances(lifted.xyz)
                    for i, (name, _, _) in enumerate(points):
                        xyz, status = [moved.xyz[i, axis] for axis in range(3)], PointStatus(moved.status[i])
                        if not lifted.found[i] or status == PointStatus.UNKNOWN or not all(map(math.isfinite, xyz)):
                            rows.append([str(result.frame), name, "", "", "", "lost", *[""] * 8])
                        else:
                            known = "tracked" if status == PointStatus.OBSERVED else "extrapolated"
                            rows.append(
                                [
                                    str(result.frame),
                                    name,
                                    *(f"{x:.4f}" for x in xyz),
                                    known,
                                    f"{moved.expected_error_mm[i]:.4f}",
                                    *(f"{round(errors.covariance[i, k], 6) + 0.0:.6f}" for k in range(6)),
                                    EVIDENCE[errors.evidence[i]],
                                ]
                            )
        with open(TRACKED / "points.csv", newline="") as file:
            expected = [[row[column] for column in COLUMNS] for row in csv.DictReader(file)]
        self.assertGreater(len(expected), 1000)
        self.assertIn("tracked", {row[5] for row in expected})
        self.assertGreater(len({row[-1] for row in expected}), 1)
        self.assertEqual(rows, expected)


if __name__ == "__main__":
    unittest.main()
