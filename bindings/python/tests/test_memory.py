"""Row 50 of docs/safety/faults.md: memory runs out at any one allocation of the library, from
context to template file.

LD_PRELOAD, from the environment, is bindings/memory_faults. DEFREC_TEST_ALLOCATION_STEP: one
allocation in so many fails, on every backend.
"""
import contextlib
import ctypes
import os
import tempfile
import unittest

import plane
from defrec import BodyMode, Context, Error, Format, Rig, State, Status, Template, Tracker

# A failure costs a few frames.
STEPS = {"reference": 397, "cpu": 29, "vulkan": 797, "cuda": 397}
FRAMES = [plane.pair(shift) for shift in range(3)]
FAULTS = ctypes.CDLL(os.environ["LD_PRELOAD"])
FAULTS.defrec_fail_allocation.argtypes = [ctypes.c_long]
FAULTS.defrec_live_allocations.restype = ctypes.c_long
NONE = -1


class EveryAllocation(unittest.TestCase):
    def context(self):
        return Context([self.plugin], only_given_plugins=True, threads=1)

    def follow(self, tracker, frame, time):
        with tracker.submit(*FRAMES[frame], time) as job:
            return job.result().state

    @contextlib.contextmanager
    def tracker(self):
        with self.context() as context:
            with Rig.rectified(context, plane.WIDTH, plane.HEIGHT, plane.CAMERA) as rig:
                with Tracker(
                    context,
                    rig,
                    self.device,
                    format=Format.GRAY8,
                    disparities=32,
                    body=BodyMode.OFF,
                ) as tracker:
                    yield context, tracker

    def scenario(self):
        """Everything that is made is closed, whatever fails; a tracker that was made stays
        usable."""
        with self.tracker() as (context, tracker):
            try:
                for frame in range(len(FRAMES)):
                    self.assertEqual(
                        self.follow(tracker, frame, frame * 33_000_000), State.TRACKING
                    )
                with tracker.template() as template:
                    template.save(self.file)
                with Template.load(context, self.file) as loaded:
                    tracker.set_template(loaded)
            except Error:
                FAULTS.defrec_fail_allocation(NONE)
                self.assertEqual(self.follow(tracker, 0, 10**9), State.TRACKING)
                raise

    def fail(self, number):
        """Status.OK, or what the scenario ended with; whether so many allocations were made; growth
        of those alive."""
        before, status = FAULTS.defrec_live_allocations(), Status.OK
        FAULTS.defrec_fail_allocation(number)
        try:
            self.scenario()
        except Error as error:
            status = error.status
        was_made = FAULTS.defrec_is_failure_to_come() == 0
        FAULTS.defrec_fail_allocation(NONE)
        return status, was_made, FAULTS.defrec_live_allocations() - before

    def check(self, backend, step):
        self.plugin = os.path.join(os.environ["PLUGINS"], f"defrec_plugin_{backend}.json")
        with self.context() as context:
            devices = [device.id for device in context.devices if device.stages]
        if not devices:
            return
        self.device = devices[0]
        # sdk/api/memory_test.cpp lets memory run out while shaders are compiled; here, a tracker
        # keeps them.
        with self.tracker():
            self.check_every_failure(backend, step)

    def check_every_failure(self, backend, step):
        for _ in range(2):
            self.scenario()
        number, failures = 0, 0
        while True:
            with self.subTest(backend=backend, allocation=number):
                status, was_made, growth = self.fail(number)
                if growth != 0:  # what is kept for ever is kept once
                    status, was_made, growth = self.fail(number)
                self.assertIn(status, (Status.OK, Status.ERROR_OUT_OF_MEMORY))
                self.assertEqual(growth, 0)
            if not was_made:
                break
            failures += status != Status.OK
            number += step
        self.assertGreater(number, 1000)
        self.assertGreater(failures, number / step / 2)
        self.scenario()

    def test_one_after_the_other_fails(self):
        asked = os.environ.get("DEFREC_TEST_ALLOCATION_STEP")
        with tempfile.TemporaryDirectory() as folder:
            self.file = os.path.join(folder, "surface")
            for _ in range(20):  # the table of handles, which is kept for ever, has grown then
                Context([], only_given_plugins=True, threads=1).close()
            for backend, step in STEPS.items():
                self.check(backend, int(asked) if asked else step)


if __name__ == "__main__":
    unittest.main()
