#!/usr/bin/env python3
"""Tests of measure_jumps.py."""
import unittest

from measure_jumps import PLAYED, SECOND, alarms, film


class AlarmsTest(unittest.TestCase):
    def test_alarms_count_whatever_other_reasons_the_frame_has(self):
        reasons = ["", "calibration", "few-matches|view-late", "calibration|view-late", "template"]
        rows = [{"reasons": each} for each in reasons]
        self.assertEqual(alarms(rows, [0]), ([5, 3], [0, 0]))

    def test_frames_of_the_second_after_a_jump_are_counted_apart(self):
        rows = [{"reasons": "calibration"}] * (10 + SECOND + 7)
        self.assertEqual(alarms(rows, [10]), ([SECOND, SECOND], [17, 17]))

    def test_a_film_plays_on_between_its_jumps(self):
        order, after = film(frames=1000, jumps=2)
        self.assertEqual(after, [PLAYED, 2 * PLAYED])
        self.assertEqual(order[PLAYED : PLAYED + 2], [0, 1])
        self.assertEqual(len(order), 3 * PLAYED)


if __name__ == "__main__":
    unittest.main()
