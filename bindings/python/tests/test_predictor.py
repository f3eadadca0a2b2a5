"""Points at the time of display with the real library: what is predicted, what is refused."""
import math
import unittest

from defrec import Error, PointStatus, PredictionBasis, Predictor, State, Status
from defrec._arrays import numpy

FRAME = 33_333_333  # ns


def swing(time_ns):
    return 4 * math.sin(8e-9 * time_ns)


def places(time_ns):
    return [(0.0, swing(time_ns), 80.0), (10.0, swing(time_ns), 80.0)]


def rows(values):
    return values.tolist()


def follow(predictor, frames):
    """The time of the last frame."""
    for i in range(1, frames + 1):
        predictor.add_frame(i * FRAME, places(i * FRAME), [0, 1], [0.1, 0.2], epoch=1)
    return frames * FRAME


class PredictorTest(unittest.TestCase):
    def test_points_are_where_they_will_be(self):
        with Predictor(2) as predictor:
            self.assertEqual((len(predictor), repr(predictor)), (2, "<Predictor, 2>"))
            now = follow(predictor, 60)
            shown = now + 2 * FRAME
            points = predictor.predict(shown)
            self.assertAlmostEqual(rows(points.xyz)[0][1], swing(shown), delta=0.02)
            self.assertGreater(abs(swing(now) - swing(shown)), 0.2)
            self.assertAlmostEqual(rows(points.xyz)[1][0], 10)
            self.assertEqual(rows(points.status), [PointStatus.OBSERVED, PointStatus.EXTRAPOLATED])
            self.assertGreaterEqual(rows(points.expected_error_mm)[1], 0.2)
            self.assertEqual(rows(points.basis), [PredictionBasis.LEARNED] * 2)
            now_again = predictor.predict(now)
            self.assertAlmostEqual(rows(now_again.xyz)[1][1], swing(now))
        with self.assertRaisesRegex(Error, "Predictor is closed"):
            predictor.predict(now)

    def test_what_the_library_made_goes_in_again(self):
        with Predictor(2) as predictor:
            now = follow(predictor, 10)
            points = predictor.predict(now + 1)
            predictor.add_frame(
                now + FRAME, points.xyz, points.status, points.expected_error_mm, epoch=1
            )
            self.assertEqual(rows(predictor.predict(now + FRAME).xyz), rows(points.xyz))
            if numpy is not None:
                predictor.add_frame(
                    now + 2 * FRAME,
                    numpy.zeros((2, 3), numpy.float32),
                    numpy.zeros(2, int),
                    numpy.ones(2),
                    epoch=1,
                )

    def test_lost_and_found(self):
        with Predictor(2) as predictor:
            now = follow(predictor, 30) + FRAME
            predictor.add_frame(now, state=State.LOST, epoch=1)
            lost = predictor.predict(now)
            self.assertEqual(rows(lost.status), [PointStatus.UNKNOWN] * 2)
            self.assertTrue(all(math.isnan(x) for row in rows(lost.xyz) for x in row))
            now += FRAME
            predictor.add_frame(now, places(now), [0, 0], state=State.RELOCALISED, epoch=2)
            found = predictor.predict(now + FRAME)
            self.assertEqual(rows(found.basis), [PredictionBasis.LAST] * 2)
            self.assertEqual(rows(found.xyz)[0][1], swing(now))

    def test_refused(self):
        for kind, words, count in (
            (Error, "point_count is 0", 0),
            (ValueError, "point_count", -1),
            (TypeError, "point_count", "3"),
            (Error, "point_count is 1000001", 1_000_001),
        ):
            with self.assertRaisesRegex(kind, words):
                Predictor(count)
        predictor = Predictor(2)
        self.addCleanup(predictor.close)
        with self.assertRaises(Error) as caught:
            predictor.predict(0)
        self.assertEqual(caught.exception.status, Status.ERROR_STATE)
        now = follow(predictor, 3)
        good, after = places(now), now + 1
        for kind, words, attempt in (
            (Error, "at most 100 ms", lambda: predictor.predict(now + 4 * FRAME)),
            (Error, "before the last frame", lambda: predictor.predict(now - 1)),
            (TypeError, "timestamp_ns", lambda: predictor.predict(0.5)),
            (ValueError, "timestamp_ns", lambda: predictor.predict(1 << 63)),
            (Error, "not after", lambda: predictor.add_frame(now, good, [0, 0])),
            (Error, "frame.xyz is NULL", lambda: predictor.add_frame(after)),
            (Error, "frame.status is NULL", lambda: predictor.add_frame(after, good)),
            (ValueError, "xyz has 1 rows", lambda: predictor.add_frame(after, good[:1], [0, 0])),
            (ValueError, "status has 3", lambda: predictor.add_frame(after, good, [0, 0, 0])),
            (ValueError, "status is 256", lambda: predictor.add_frame(after, good, [0, 256])),
            (TypeError, "status", lambda: predictor.add_frame(after, good, [0, 0.5])),
            (Error, "point 1 is 9", lambda: predictor.add_frame(after, good, [0, 9])),
            (Error, "point 0 is -1", lambda: predictor.add_frame(after, good, [0, 0], [-1, 0])),
            (
                Error,
                "frame.xyz of point 1 has",
                lambda: predictor.add_frame(after, [(0, 0, 80), (0, math.nan, 80)], [0, 0]),
            ),
        ):
            with self.subTest(words), self.assertRaisesRegex(kind, words):
                attempt()
        self.assertEqual(rows(predictor.predict(now).xyz)[0][1], swing(now))


if __name__ == "__main__":
    unittest.main()
