"""Failures: status and error message reach the exception, and what was made is given back, once, in
any order. Against the stub."""
import copy
import gc
import pickle
import unittest
from unittest import mock

import stub
from defrec import (
    BusyError,
    Camera,
    Context,
    Error,
    OrbParams,
    Rig,
    Stage,
    Status,
    Targets,
    Template,
    Tracker,
    _handle,
    _library,
    detect_scan,
)
from description import CONTRACT, argument

CAMERA = Camera(fx=500, fy=500, cx=50, cy=40, baseline_mm=4.5)
IMAGE = bytes(96 * 80 * 3)


def make_all():
    """One object of every kind, in the order in which they are made."""
    context = Context()
    rig = Rig.rectified(context, 96, 80, CAMERA)
    tracker = Tracker(context, rig)
    things = {
        "context": context,
        "rig": rig,
        "tracker": tracker,
        "stage": Stage(context, OrbParams()),
        "memory": tracker.import_memory(bytearray(IMAGE)),
        "template": tracker.template(),
        "loaded": Template.load(context, "/x"),
        "job": tracker.submit(IMAGE, IMAGE, 1),
    }
    things["targets"] = Targets(things["loaded"], [(1, 2, 3)])
    return things


class Failures(stub.StubTest):
    def test_status_and_sentence(self):
        things = make_all()
        context, rig, tracker, job, template = (
            things[name] for name in ("context", "rig", "tracker", "job", "template")
        )
        stub.answer("defrec_plugin_count", 1)
        stub.answer("defrec_device_count", 1)
        attempts = {
            "defrec_context_create": Context,
            "defrec_plugin_get": lambda: context.plugins,
            "defrec_device_get": lambda: context.devices,
            "defrec_rig_create": lambda: Rig.rectified(context, 96, 80, CAMERA),
            "defrec_rig_get": lambda: Rig.rectified(context, 96, 80, CAMERA),
            "defrec_rig_rectify_pixels": lambda: rig.rectify_pixels([(1, 2)]),
            "defrec_rig_distort_pixels": lambda: rig.distort_pixels([(1, 2)]),
            "defrec_stage_create": lambda: Stage(context, OrbParams()),
            "defrec_stage_prepare": lambda: things["stage"].prepare_buffers([]),
            "defrec_stage_run": lambda: things["stage"].run_buffers([], []),
            "defrec_tracker_create": lambda: Tracker(context, rig),
            "defrec_memory_import": lambda: tracker.import_memory(bytearray(4)),
            "defrec_tracker_submit": lambda: tracker.submit(IMAGE, IMAGE, 1),
            "defrec_job_wait": job.wait,
            "defrec_job_result": job.result,
            "defrec_job_get_template": job.template,
            "defrec_job_lift_points": lambda: job.lift_points([(1, 2)]),
            "defrec_job_warp_points": lambda: job.warp_points([(1, 2, 3)]),
            "defrec_job_point_covariances": lambda: job.point_covariances([(1, 2, 3)]),
            "defrec_tracker_get_template": tracker.template,
            "defrec_tracker_set_template": lambda: tracker.set_template(template),
            "defrec_template_get": template.data,
            "defrec_template_lift": lambda: template.lift([(1, 2)]),
            "defrec_detect_scan": lambda: detect_scan(IMAGE, IMAGE, 96, 80),
            "defrec_template_point_pieces": lambda: template.point_pieces([(1, 2, 3)]),
            "defrec_template_set_body": lambda: template.set_body(poisson_ratio=9),
            "defrec_template_wait_body": template.wait_body,
            "defrec_targets_create": lambda: Targets(template, [(1, 2, 3)]),
            "defrec_job_move_targets": lambda: job.move_targets(things["targets"]),
            "defrec_job_to_fixed_frame": lambda: job.to_fixed_frame([(1, 2, 3)]),
            "defrec_template_save": lambda: template.save("/x"),
            "defrec_template_load": lambda: Template.load(context, "/x"),
        }
        stub.calls()
        for name, attempt in attempts.items():
            with self.subTest(name):
                stub.answer(name, Status.ERROR_IO, f"{name}: é was given")
                with self.assertRaises(Error) as caught:
                    attempt()
                self.assertIs(caught.exception.status, Status.ERROR_IO)
                self.assertEqual(caught.exception.message, f"{name}: é was given")
                self.assertEqual(str(caught.exception), f"{name}: é was given (DEFREC_ERROR_IO)")
                stub.answer(name, 0)
                del caught
                gc.collect()
                created, destroyed = stub.created_and_destroyed(stub.calls())
                self.assertEqual(created, destroyed, "a failed call leaves nothing behind")

    def test_every_function_raises(self):
        for function in CONTRACT["functions"]:
            if function["returns"] != "defrec_status":
                continue
            stub.answer(function["name"], Status.ERROR_IO, "é was given")
            with self.assertRaisesRegex(Error, "é was given"):
                call = getattr(_library.native, function["name"])
                call(*(argument(i, each)[0] for i, each in enumerate(function["parameters"])))

    def test_busy(self):
        tracker = make_all()["tracker"]
        stub.answer("defrec_tracker_submit", Status.ERROR_BUSY, "full")
        with self.assertRaises(BusyError) as caught:
            tracker.submit(IMAGE, IMAGE, 1)
        self.assertIs(caught.exception.status, Status.ERROR_BUSY)

    def test_status_of_a_later_library(self):
        stub.answer("defrec_context_create", -55, "new")
        with self.assertRaises(Error) as caught:
            Context()
        self.assertEqual(
            (caught.exception.status, caught.exception.status.name), (-55, "UNKNOWN_-55")
        )

    def test_a_failing_job_ends_process(self):
        tracker = make_all()["tracker"]
        gc.collect()
        stub.calls()
        stub.answer("defrec_job_wait", Status.ERROR_STATE, "gone")
        with self.assertRaisesRegex(Error, "gone"):
            for _ in tracker.process((IMAGE, IMAGE, i) for i in range(5)):
                self.fail("no job was done")
        created, destroyed = stub.created_and_destroyed(stub.calls())
        self.assertEqual((sorted(created), len(created)), (sorted(destroyed), 2))


class Lifetimes(stub.StubTest):
    def assert_each_is_given_back_once(self):
        gc.collect()
        created, destroyed = stub.created_and_destroyed(stub.calls())
        self.assertEqual(len(created), 9)
        self.assertEqual(sorted(created), sorted(destroyed))

    def test_closed_twice(self):
        gc.collect()
        stub.calls()
        things = make_all()
        for thing in things.values():
            self.assertFalse(thing.is_closed)
            thing.close()
            thing.close()
            self.assertTrue(thing.is_closed)
        del thing, things
        self.assert_each_is_given_back_once()

    def test_any_order(self):
        for start in range(9):
            gc.collect()
            stub.calls()
            things = list(make_all().values())
            while things:
                del things[start % len(things)]
            self.assert_each_is_given_back_once()

    def test_collected_as_a_cycle(self):
        gc.collect()
        stub.calls()
        things = make_all()
        things["self"] = things
        del things
        self.assert_each_is_given_back_once()

    def test_use_after_close(self):
        things = make_all()
        uses = {
            "context": [
                lambda c: c.plugins,
                lambda c: c.devices,
                lambda c: Tracker(c, things["rig"]),
                lambda c: Stage(c, OrbParams()),
            ],
            "rig": [
                lambda r: r.rectify_pixels([(1, 2)]),
                lambda r: r.distort_pixels([(1, 2)]),
                lambda r: Tracker(things["context"], r),
            ],
            "stage": [lambda s: s.prepare_buffers([]), lambda s: s.run_buffers([], [])],
            "memory": [
                lambda m: things["tracker"].submit(m, IMAGE, 1),
                lambda m: things["tracker"].submit(IMAGE, IMAGE, 1, samples=m),
            ],
            "job": [
                lambda j: j.wait(),
                lambda j: j.result(),
                lambda j: j.template(),
                lambda j: j.lift_points([(1, 2)]),
                lambda j: j.warp_points([(1, 2, 3)]),
                lambda j: j.point_covariances([(1, 2, 3)]),
                lambda j: j.move_targets(other),
                lambda j: j.to_fixed_frame([(1, 2, 3)]),
            ],
            "targets": [lambda t: things["job"].move_targets(t), lambda t: t.__enter__()],
            "template": [
                lambda t: t.lift([(1, 2)]),
                lambda t: t.data(),
                lambda t: t.save("/x"),
                lambda t: t.set_body(),
                lambda t: t.wait_body(),
                lambda t: Targets(t, [(1, 2, 3)]),
                lambda t: things["tracker"].set_template(t),
            ],
            "tracker": [
                lambda t: t.submit(IMAGE, IMAGE, 1),
                lambda t: t.template(),
                lambda t: t.import_memory(bytearray(4)),
            ],
            "loaded": [lambda t: t.__enter__()],
        }
        other = Targets(things["loaded"], [])
        order = [
            "memory",
            "template",
            "targets",
            "job",
            "stage",
            "rig",
            "tracker",
            "loaded",
            "context",
        ]
        self.assertEqual(sorted(order), sorted(uses))
        for name in order:
            things[name].close()
            stub.calls()
            for use in uses[name]:
                with self.assertRaises(Error) as caught:
                    use(things[name])
                self.assertIs(caught.exception.status, Status.ERROR_HANDLE)
                self.assertIn("is closed", str(caught.exception))
            self.assertEqual(stub.lines(), [], "nothing reaches the library")

    def test_what_a_callback_collects_is_given_back_later(self):
        received = []
        context = Context(log=lambda *arguments: received.append(arguments))
        other = Context()
        handle = hex(other._native)
        with _handle.CallbackScope():
            other.close()
            self.assertNotIn(f"defrec_context_destroy(context={handle})", stub.lines())
        Context().close()
        self.assertIn(f"defrec_context_destroy(context={handle})", stub.lines())
        context._keep(None, 3, b"sdk", "ä".encode())
        self.assertEqual(received, [(3, "sdk", "ä")])

    def copies(self):
        """Every copy of what the library points to: the function that tells where, the object, and
        the call."""
        things = make_all()
        stub.answer("defrec_plugin_count", 1)
        stub.answer("defrec_device_count", 1)
        return {
            "defrec_job_result": (things["job"], lambda: things["job"].result()),
            "defrec_template_get": (things["template"], lambda: things["template"].data()),
            "defrec_plugin_get": (things["context"], lambda: things["context"].plugins),
            "defrec_device_get": (things["context"], lambda: things["context"].devices),
        }

    def test_not_closed_while_copying(self):
        """What the library points to is gone when the handle is: another thread's close() waits for
        the copy."""
        for name, (thing, copy_out) in self.copies().items():
            called = []

            def look(*arguments):
                called.append(thing._lock._is_owned())

            with mock.patch.object(_library.native, name, look):
                copy_out()
            self.assertEqual(called, [True], name)
            self.assertFalse(thing._lock._is_owned())
        thing._lock = mock.MagicMock()
        thing.close()
        thing._lock.__enter__.assert_called_once_with()

    def test_closed_in_the_middle_of_a_copy(self):
        """By a signal handler or a finaliser, on the thread that copies: it cannot wait for the
        copy."""
        for name in self.copies():
            thing, copy_out = self.copies()[name]
            handle = hex(thing._native)

            def given_back():
                return stub.created_and_destroyed(stub.calls())[1].count(handle)

            def interrupt(*arguments):
                thing.close()
                self.assertEqual(given_back(), 0)

            with self.subTest(name), mock.patch.object(_library.native, name, interrupt):
                copy_out()
                self.assertTrue(thing.is_closed)
                self.assertEqual(given_back(), 1)

    def test_interrupted_creation(self):
        """KeyboardInterrupt comes right behind the call that it arrived in."""
        things = make_all()
        context, rig, tracker = (things[name] for name in ("context", "rig", "tracker"))
        attempts = {
            "defrec_context_create": Context,
            "defrec_rig_create": lambda: Rig.rectified(context, 96, 80, CAMERA),
            "defrec_stage_create": lambda: Stage(context, OrbParams()),
            "defrec_tracker_create": lambda: Tracker(context, rig),
            "defrec_memory_import": lambda: tracker.import_memory(bytearray(4)),
            "defrec_tracker_submit": lambda: tracker.submit(IMAGE, IMAGE, 1),
            "defrec_tracker_get_template": tracker.template,
            "defrec_template_load": lambda: Template.load(context, "/x"),
            "defrec_targets_create": lambda: Targets(things["template"], [(1, 2, 3)]),
        }
        stub.calls()
        for name, attempt in attempts.items():
            create = getattr(_library.native, name)

            def interrupted(*arguments):
                create(*arguments)
                raise KeyboardInterrupt

            with self.subTest(name), mock.patch.object(_library.native, name, interrupted):
                with self.assertRaises(KeyboardInterrupt):
                    attempt()
                gc.collect()
                created, destroyed = stub.created_and_destroyed(stub.calls())
                self.assertEqual((len(created), created), (1, destroyed))

    def test_neither_copied_nor_pickled(self):
        for attempt in (copy.copy, copy.deepcopy, pickle.dumps):
            with self.assertRaises(TypeError):
                attempt(Context())

    def test_memory_stays_while_a_job_reads_it(self):
        tracker = make_all()["tracker"]
        buffer = bytearray(IMAGE)
        memory = tracker.import_memory(buffer)
        job = tracker.submit(memory, IMAGE, 1)
        memory.close()
        with self.assertRaises(BufferError):
            buffer.extend(b"moved")
        job.close()
        buffer.extend(b"moved")

    def test_arrays_are_free_after_submit(self):
        tracker = make_all()["tracker"]
        buffer = bytearray(IMAGE)
        with tracker.submit(buffer, buffer, 1):
            buffer.extend(b"moved")
        with mock.patch.object(
            _library.native, "defrec_tracker_submit", side_effect=Error(Status.ERROR_BUSY, "full")
        ):
            with self.assertRaises(Error):
                tracker.submit(buffer[: len(IMAGE)], buffer[: len(IMAGE)], 1)
        buffer.extend(b"moved")


if __name__ == "__main__":
    unittest.main()
