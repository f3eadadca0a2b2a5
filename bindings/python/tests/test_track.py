"""A real track of a reference sequence: its points equal those that `defrec track` wrote, digit for
digit.

SEQUENCE and TRACKED, from the environment: what `defrec render` wrote and what `defrec track` made
of it.
"""
import csv
import itertools
import math
import os
import pathlib
import re
import unittest

from PIL import Image

from defrec import BodyState, Context, Error, Format, PointStatus, Rig, Status, Targets, Tracker
from defrec._arrays import numpy

SEQUENCE, TRACKED = (pathlib.Path(os.environ[name]) for name in ("SEQUENCE", "TRACKED"))
COVARIANCE = ["xx", "xy", "xz", "yy", "yz", "zz"]
COLUMNS = ["frame", "id", "x", "y", "z", "status", "expected_error_mm", *COVARIANCE, "evidence"]
EVIDENCE = ["none", "depth", "photometric", "both"]


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
                        template = tracker.template()
                        template.wait_body()  # as the program does
                        lifted = template.lift(rig.rectify_pixels([(u, v) for _, u, v in points]))
                    moved = job.warp_points(lifted.xyz)
                    errors = job.point_covariances(lifted.xyz)
                    for i, (name, _, _) in enumerate(points):
                        xyz, status = [moved.xyz[i, axis] for axis in range(3)], PointStatus(
                            moved.status[i]
                        )
                        if (
                            not lifted.found[i]
                            or status == PointStatus.UNKNOWN
                            or not all(map(math.isfinite, xyz))
                        ):
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
                                    *(
                                        f"{round(errors.covariance[i, k], 6) + 0.0:.6f}"
                                        for k in range(6)
                                    ),
                                    EVIDENCE[errors.evidence[i]],
                                ]
                            )
        with open(TRACKED / "points.csv", newline="") as file:
            expected = [[row[column] for column in COLUMNS] for row in csv.DictReader(file)]
        self.assertGreater(len(expected), 1000)
        self.assertIn("tracked", {row[5] for row in expected})
        self.assertGreater(len({row[-1] for row in expected}), 1)
        self.assertEqual(rows, expected)

    def test_targets_move_as_points_do(self):
        with Context() as context, Rig(context, 320, 240, **calibration()) as rig:
            with Tracker(context, rig, "cpu", format=Format.RGB8, frames_in_flight=1) as tracker:
                targets = None
                for job in tracker.process(itertools.islice(frames(), 4)):
                    if targets is None:
                        template = job.template()
                        vertices = [
                            vertex.tolist()[0] if numpy else list(vertex.position)
                            for vertex in template.data().vertices
                        ]
                        # Up to 5 mm beneath the surface, along the line of sight.
                        plan = [
                            [x * (1 + i % 5 / at[2]) for x in at] for i, at in enumerate(vertices)
                        ]
                        plan[1][0] = math.nan
                        template.set_body(poisson_ratio=0.45)
                        template.wait_body()
                        with self.assertRaises(Error) as caught:  # it is open
                            template.set_body(([(0, 0, 50), (9, 0, 50), (0, 9, 50)], [(0, 1, 2)]))
                        self.assertIs(caught.exception.status, Status.ERROR_ARGUMENT)
                        targets = Targets(template, plan)
                        template.close()
                        self.assertEqual(len(targets), len(plan))
                    moved, points, errors = (
                        job.move_targets(targets),
                        job.warp_points(plan),
                        job.point_covariances(plan),
                    )
                    self.assertIs(job.result().body, BodyState.READY)
                    self.assertEqual(moved.status.tolist(), points.status.tolist())
                    self.assertIn(PointStatus.EXTRAPOLATED, moved.status.tolist())
                    self.assertEqual(moved.status[1], PointStatus.UNKNOWN)
                    self.assertTrue(math.isnan(moved.xyz[1, 0]))
                    for i in range(2, len(plan)):
                        self.assertAlmostEqual(
                            moved.expected_error_mm[i], points.expected_error_mm[i], delta=1e-6
                        )
                        for k in range(3):
                            self.assertAlmostEqual(moved.xyz[i, k], points.xyz[i, k], delta=1e-6)
                        for k in range(6):
                            self.assertAlmostEqual(
                                moved.covariance[i, k], errors.covariance[i, k], delta=1e-6
                            )


if __name__ == "__main__":
    unittest.main()
