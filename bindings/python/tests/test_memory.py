"""Row 50 of docs/faults.md: memory runs out at any one allocation of the library, from context to template file.

LD_PRELOAD, from the environment, is bindings/memory_faults. DEFREC_TEST_EVERY_ALLOCATION: all of them, not one in STEP.
"""
import ctypes
import os
import tempfile
import unittest

import plane
from defrec import Context, Error, Format, Rig, State, Status, Template, Tracker

STEP = 1 if "DEFREC_TEST_EVERY_ALLOCATION" in os.environ else 29
FRAMES = [plane.pair(shift) for shift in range(3)]
FAULTS = ctypes.CDLL(os.environ["LD_PRELOAD"])
FAULTS.defrec_fail_allocation.argtypes = [ctypes.c_long]
FAULTS.defrec_live_allocations.restype = ctypes.c_long
NONE = -1


class EveryAllocation(unittest.TestCase):
    def follow(self, tracker, frame, time):
        with tracker.submit(*FRAMES[frame], time) as job:
            return job.result().state

    def scenario(self, file):
        """Everything that is made is closed, whatever fails; a tracker that was made stays usable."""
        with Context([os.environ["PLUGIN"]], only_given_plugins=True, threads=1) as context:
            with Rig.rectified(context, plane.WIDTH, plane.HEIGHT, plane.CAMERA) as rig:
                with Tracker(context, rig, "cpu", format=Format.GRAY8) as tracker:
                    try:
                        for frame in range(len(FRAMES)):
                            self.assertEqual(self.follow(tracker, frame, frame * 33_000_000), State.TRACKING)
                        with tracker.template() as template:
                            template.save(file)
                        with Template.load(context, file) as loaded:
                            tracker.set_template(loaded)
                    except Error:
                        FAULTS.defrec_fail_allocation(NONE)
                        self.assertEqual(self.follow(tracker, 0, 10**9), State.TRACKING)
                        raise

    def fail(self, number, file):
        """Status.OK, or what the scenario ended with; whether so many allocations were made; growth of those alive."""
        before, status = FAULTS.defrec_live_allocations(), Status.OK
        FAULTS.defrec_fail_allocation(number)
        try:
            self.scenario(file)
        except Error as error:
            status = error.status
        was_made = FAULTS.defrec_is_failure_to_come() == 0
        FAULTS.defrec_fail_allocation(NONE)
        return status, was_made, FAULTS.defrec_live_allocations() - before

    def test_one_after_the_other_fails(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "surface")
            for _ in range(20):  # what is kept for ever has grown then
                self.scenario(file)
            number, failures = 0, 0
            while True:
                with self.subTest(allocation=number):
                    status, was_made, growth = self.fail(number, file)
                    if growth != 0:  # what is kept for ever is kept once
                        status, was_made, growth = self.fail(number, file)
                    self.assertIn(status, (Status.OK, Status.ERROR_OUT_OF_MEMORY))
                    self.assertEqual(growth, 0)
                failures += status != Status.OK
                if not was_made:
                    break
                number += STEP
            self.assertGreater(failures, 1000 / STEP)
            self.scenario(file)


if __name__ == "__main__":
    unittest.main()
