"""Registration and hand-eye calibration with the real library: what comes out, what is refused."""
import math
import unittest

from defrec import (
    Context,
    Deformation,
    Error,
    FreeMotionKind,
    HandEye,
    PointStatus,
    Registration,
    Status,
    Verdict,
)
from defrec._arrays import numpy

IDENTITY = [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)]
PLACES = [(0, 0, -50), (60, 10, -30), (-40, 30, -35), (10, -45, -20), (-70, -10, -20)]
SHIFT = (5, -3, 150)
VARIANCES = [(0.25, 0, 0, 0.25, 0, 0.25)] * len(PLACES)


def shifted(places):
    return [tuple(a + b for a, b in zip(place, SHIFT)) for place in places]


def rows(values):
    """An array as nested lists, with NumPy and without."""
    return values.tolist()


def organ(columns=36, lines=18):
    """A closed surface without symmetry: vertices and triangles."""
    vertices = []
    for i in range(lines + 1):
        for j in range(columns):
            t, f = math.pi * i / lines, 2 * math.pi * j / columns
            d = (math.sin(t) * math.cos(f), math.sin(t) * math.sin(f), math.cos(t))
            r = 50 * (
                1
                + 0.25 * math.sin(2 * d[0] + 1)
                + 0.2 * math.cos(3 * d[1] * d[0] + 0.5)
                + 0.15 * math.sin(2.5 * d[2] + d[1])
            )
            place = (1.4 * r * d[0], r * d[1], 0.8 * r * d[2])
            vertices.append(tuple(round(value, 6) + 0.0 for value in place))  # no -0 at the poles
    triangles = []
    for i in range(lines):
        for j in range(columns):
            a, b = i * columns + j, i * columns + (j + 1) % columns
            triangles += [(a, a + columns, b), (b, a + columns, b + columns)]
    return vertices, triangles


VERTICES, TRIANGLES = organ()
# The front, which a camera in the origin of the seen frame sees.
FRONT = [place for place in VERTICES if place[2] < -8]


class RegistrationTest(unittest.TestCase):
    def setUp(self):
        self.context = Context(only_given_plugins=True, threads=1)
        self.addCleanup(self.context.close)

    def test_pairs(self):
        with Registration.from_pairs(PLACES, shifted(PLACES), seen_covariance=VARIANCES) as found:
            result = found.result()
            moved = found.move_points([(0, 0, -40), (float("nan"), 0, 0), (300, 0, 0)])
        self.assertEqual(result.verdict, Verdict.ACCEPTED)
        self.assertGreater(len(result.reason), 10)
        for row, expected in zip(rows(result.transform), zip(*IDENTITY)):
            self.assertEqual(len(row), 4)
        self.assertAlmostEqual(rows(result.transform)[2][3], 150)
        self.assertEqual((len(rows(result.covariance)), result.used), (6, 5))
        self.assertEqual(rows(result.inliers), [True] * 5)
        self.assertEqual((len(result.residuals), len(result.triangles)), (5, 0))
        self.assertEqual((result.free_motions, result.alternatives), ([], []))
        for got, expected in zip(rows(moved.xyz)[0], (5, -3, 110)):
            self.assertAlmostEqual(got, expected)
        errors, covariance = rows(moved.expected_error_mm), rows(moved.covariance)
        self.assertTrue(math.isnan(errors[1]) and math.isnan(rows(moved.xyz)[1][0]))
        self.assertGreater(errors[2], 3 * errors[0])
        self.assertAlmostEqual(
            errors[2], math.sqrt(covariance[2][0] + covariance[2][3] + covariance[2][5])
        )

    def test_free_motions(self):
        line = [(0, 0, 0), (20, 0, 0), (40, 0, 0), (70, 0, 0)]
        with Registration.from_pairs(line, shifted(line)) as found:
            result = found.result()
        self.assertEqual(result.verdict, Verdict.UNDETERMINED)
        (motion,) = result.free_motions
        self.assertEqual(motion.kind, FreeMotionKind.TURN)
        self.assertAlmostEqual(abs(rows(motion.axis)[0]), 1, 3)
        self.assertEqual(len(motion.point), 3)
        self.assertIn("turn about the axis", motion.text)
        self.assertEqual(motion.expected_rad, 0)

    def test_surface(self):
        seen = shifted(FRONT)
        start = [(1, 0, 0, 9), (0, 1, 0, -7), (0, 0, 1, 156)]
        with Registration.from_surface(
            self.context, (VERTICES, TRIANGLES), seen, start=start, point_error_mm=0.2
        ) as found:
            result = found.result()
        self.assertEqual(result.verdict, Verdict.ACCEPTED, result.reason)
        for row, expected in zip(rows(result.transform), SHIFT):
            self.assertAlmostEqual(row[3], expected, delta=0.5)
        self.assertEqual(len(result.residuals), len(seen))
        self.assertGreater(result.inlier_share, 0.9)
        # Triangles at the poles have no area.
        self.assertEqual(len(result.triangles) + result.dropped_triangles, len(TRIANGLES))
        self.assertTrue(result.model_has_outside and not result.model_turned)

    def test_an_elastic_model_that_is_as_it_was(self):
        # The poles are vertices of many triangles at one place.
        start = [(1, 0, 0, 9), (0, 1, 0, -7), (0, 0, 1, 156)]
        with Registration.from_surface(
            self.context,
            (VERTICES, TRIANGLES),
            shifted(FRONT),
            start=start,
            point_error_mm=0.2,
            elastic=True,
            deformation_mm=5,
        ) as found:
            result = found.result()
        self.assertEqual(result.deformation, Deformation.REFUSED, result.deformation_text)
        self.assertIn("rigid motion", result.deformation_text)
        self.assertEqual((result.deformed_rms_mm, result.deformed_max_mm), (0, 0))
        self.assertEqual(result.largest_strain, 0)
        self.assertEqual(result.rigid_rms_mm, result.rms_mm)
        self.assertEqual(result.rigid_robust_mm, result.robust_mm)

    def test_status_and_errors_of_points(self):
        seen = shifted(FRONT)
        status = [PointStatus.OBSERVED] * len(seen)
        for i in range(0, len(seen), 10):
            seen[i] = (0, 0, 1000)
            status[i] = PointStatus.UNKNOWN
        with Registration.from_surface(
            self.context,
            (VERTICES, TRIANGLES),
            seen,
            covariance=[(0.01, 0, 0, 0.01, 0, 0.09)] * len(seen),
            normals=[(0, 0, -1)] * len(seen),
            status=status,
            start=[(1, 0, 0, 5), (0, 1, 0, -3), (0, 0, 1, 150)],
            camera=False,
            starts=3,
        ) as found:
            result = found.result()
        residuals, inliers = rows(result.residuals), rows(result.inliers)
        self.assertTrue(math.isnan(residuals[0]) and not inliers[0])
        self.assertTrue(not math.isnan(residuals[1]))

    def test_what_is_refused(self):
        model = VERTICES, TRIANGLES
        surface, pairs = Registration.from_surface, Registration.from_pairs
        for error, text, call in (
            (Error, "2 pairs were given", lambda: pairs(PLACES[:2], PLACES[:2])),
            (ValueError, "seen_xyz has 4 rows", lambda: pairs(PLACES, PLACES[:4])),
            (
                ValueError,
                "model_covariance has 4 rows",
                lambda: pairs(PLACES, PLACES, model_covariance=VARIANCES[:4]),
            ),
            ((TypeError, ValueError), "model_xyz", lambda: pairs([1, 2], PLACES)),
            (Error, "desc.max_error_mm is -1", lambda: pairs(PLACES, PLACES, max_error_mm=-1)),
            (TypeError, "context is a Context", lambda: surface(None, model, FRONT)),
            (TypeError, "model: vertices", lambda: surface(self.context, None, FRONT)),
            (
                TypeError,
                "no option colour",
                lambda: surface(self.context, model, FRONT, colour=1),
            ),
            (
                ValueError,
                "normals has 1 rows",
                lambda: surface(self.context, model, FRONT, normals=[(0, 0, 1)]),
            ),
            (
                ValueError,
                "status has 1 rows",
                lambda: surface(self.context, model, FRONT, status=[0]),
            ),
            (ValueError, "start has", lambda: surface(self.context, model, FRONT, start=[1, 2])),
            (Error, "points of the surface", lambda: surface(self.context, model, FRONT[:9])),
            (Error, "desc.model_vertex_count", lambda: surface(self.context, ([], []), FRONT)),
            (Error, "the model", lambda: surface(self.context, (VERTICES[:9], TRIANGLES), FRONT)),
            (
                TypeError,
                "template is a Template",
                lambda: Registration.from_template(self.context, None, model),
            ),
        ):
            with self.subTest(text):
                with self.assertRaises(error) as caught:
                    call()
                self.assertIn(text, str(caught.exception))
        found = pairs(PLACES, PLACES)
        with self.assertRaises(ValueError):
            found.move_points([(1, 2)])
        self.assertEqual([len(part) for part in found.move_points([])], [0, 0, 0])
        found.close()
        for use in (found.result, lambda: found.move_points([(1, 2, 3)])):
            with self.assertRaisesRegex(Error, "Registration is closed"):
                use()


def turn(axis, angle):
    """A rotation about an axis of the frame."""
    c, s = math.cos(angle), math.sin(angle)
    i, k = (axis + 1) % 3, (axis + 2) % 3
    made = [[float(row == column) for column in range(3)] for row in range(3)]
    made[i][i] = made[k][k] = c
    made[i][k], made[k][i] = -s, s
    return made


def times(a, b):
    """The product of two poses, 3x4."""
    return [
        [sum(a[i][k] * b[k][j] for k in range(3)) + (a[i][3] if j == 3 else 0) for j in range(4)]
        for i in range(3)
    ]


def pose(rotation, place):
    return [[*row, float(value)] for row, value in zip(rotation, place)]


MARKER_FROM_CAMERA = pose(turn(1, 0.4), (40, -30, 250))
CAMERA_FROM_MARKER = pose(
    turn(1, -0.4),
    [-sum(turn(1, -0.4)[i][k] * MARKER_FROM_CAMERA[k][3] for k in range(3)) for i in range(3)],
)
TRACKER_FROM_WORLD = pose(turn(2, 1.1), (200, -100, 1500))


def camera_pose(i):
    rotation = turn(i % 3, 0.3 + 0.1 * i)
    return pose(rotation, (10 * i, 5 * (i % 4), -100 - 7 * (i % 3)))


def marker_pose(camera):
    return times(times(TRACKER_FROM_WORLD, camera), CAMERA_FROM_MARKER)


class HandEyeTest(unittest.TestCase):
    def test_pairs(self):
        camera = [camera_pose(i) for i in range(8)]
        with HandEye(
            camera, [marker_pose(each) for each in camera], errors=(0.1, 0.001, 0.1, 0.001)
        ) as found:
            result = found.result()
            poses = found.camera_poses([marker_pose(camera_pose(5)), marker_pose(camera_pose(9))])
            self.assertEqual(len(found.camera_poses([])), 0)
            covariance = rows(found.pose_covariance(marker_pose(camera_pose(5))))
        self.assertEqual(result.verdict, Verdict.ACCEPTED, result.reason)
        self.assertTrue(result.is_solved and not result.offset_estimated)
        for got, expected in zip(rows(result.marker_from_camera), MARKER_FROM_CAMERA):
            for number, right in zip(got, expected):
                self.assertAlmostEqual(number, right, 5)
        self.assertEqual((len(covariance), len(covariance[0])), (6, 6))
        for i in range(6):
            # The marker's own error, 0.001 rad or 0.1 mm, is a part of it.
            self.assertGreater(covariance[i][i], (0.001 if i < 3 else 0.1) ** 2)
            self.assertAlmostEqual(covariance[i][0], covariance[0][i], 9)
        self.assertEqual(rows(result.inliers), [True] * 8)
        self.assertEqual((len(result.residuals_mm), len(result.residuals_rad)), (8, 8))
        self.assertEqual((result.used, result.inlier_count, result.notes), (8, 8, []))
        self.assertAlmostEqual(result.camera_error_mm, 0.1)
        expected = times(TRACKER_FROM_WORLD, camera_pose(9))
        for got, right in zip(rows(poses)[1], expected):
            for number, value in zip(got, right):
                self.assertAlmostEqual(number, value, 5)

    def test_streams_with_a_known_offset(self):
        def at(time):
            rotation = [
                row[:3]
                for row in times(
                    pose(turn(0, 0.5 * math.sin(1.1 * time)), (0, 0, 0)),
                    pose(turn(1, 0.5 * math.cos(0.8 * time)), (0, 0, 0)),
                )
            ]
            return pose(rotation, (20 * math.sin(time), 15 * math.cos(1.3 * time), -100))

        moments = [i / 30 for i in range(450)]
        camera = [at(time) for time in moments]
        tracker = [marker_pose(each) for each in camera]
        with HandEye(
            camera, tracker, moments, [time + 0.25 for time in moments], offset=0.25
        ) as found:
            self.assertEqual(found.result().verdict, Verdict.ACCEPTED, found.result().reason)
            self.assertEqual(found.result().offset_s, 0.25)

    def test_a_refused_one(self):
        camera = [pose(turn(0, 0), (i, i * i, 0)) for i in range(6)]
        with HandEye(camera, [marker_pose(each) for each in camera]) as found:
            result = found.result()
            self.assertEqual(result.verdict, Verdict.UNDETERMINED)
            self.assertFalse(result.is_solved)
            self.assertEqual(len(result.residuals_mm), 0)
            self.assertTrue(math.isnan(rows(result.covariance)[0][0]))
            self.assertEqual(
                [each.kind for each in result.free_motions], [FreeMotionKind.SHIFT] * 3
            )
            with self.assertRaises(Error) as caught:
                found.camera_poses([IDENTITY])
            self.assertIs(caught.exception.status, Status.ERROR_STATE)
            with self.assertRaises(Error):
                found.pose_covariance(IDENTITY)
            self.assertIn(result.reason, str(caught.exception))

    def test_what_is_refused(self):
        camera = [camera_pose(i) for i in range(4)]
        for error, text, call in (
            (Error, "4 poses of the camera and 3", lambda: HandEye(camera, camera[:3])),
            (ValueError, "both expected", lambda: HandEye(camera, camera, [0, 1, 2, 3])),
            (
                ValueError,
                "camera_times has 2 times",
                lambda: HandEye(camera, camera, [0, 1], [0, 1, 2, 3]),
            ),
            (ValueError, "camera_poses[0] has", lambda: HandEye([[1, 2, 3]], camera)),
            (TypeError, "camera_poses", lambda: HandEye(None, camera)),
            (ValueError, "errors has 2", lambda: HandEye(camera, camera, errors=(1, 2))),
            (
                Error,
                "of the four errors",
                lambda: HandEye(camera, camera, errors=(1, 0.1, 0, 0)),
            ),
            (Error, "is no rotation", lambda: HandEye(camera, [[[2] * 4] * 3] * 4)),
            (Error, "max_offset_s is -1", lambda: HandEye(camera, camera, max_offset=-1)),
        ):
            with self.subTest(text):
                with self.assertRaises(error) as caught:
                    call()
                self.assertIn(text, str(caught.exception))
        found = HandEye(camera, [marker_pose(each) for each in camera])
        found.close()
        with self.assertRaisesRegex(Error, "HandEye is closed"):
            found.result()


@unittest.skipIf(numpy is None, "with NumPy")
class ArrayTest(unittest.TestCase):
    def test_arrays_come_in_and_out(self):
        places = numpy.array(PLACES, dtype=numpy.float32)
        with Registration.from_pairs(places, places + numpy.array(SHIFT)) as found:
            result = found.result()
            self.assertEqual(result.transform.shape, (3, 4))
            self.assertEqual(result.inliers.dtype, bool)
            moved = found.move_points(places)
            self.assertTrue(numpy.allclose(moved.xyz, places + numpy.array(SHIFT)))
        with Context(only_given_plugins=True) as context, Registration.from_surface(
            context,
            (numpy.array(VERTICES), numpy.array(TRIANGLES)),
            numpy.array(shifted(FRONT)),
            status=numpy.zeros(len(FRONT), numpy.uint8),
            start=numpy.vstack([numpy.array(IDENTITY) + [0, 0, 0, 0], [0, 0, 0, 1]]),
            max_shift_mm=200,
            viewer=numpy.zeros(3),
        ) as found:
            self.assertEqual(found.result().triangles.shape[1], 3)


if __name__ == "__main__":
    unittest.main()
