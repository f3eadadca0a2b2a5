"""The binding and the real library together, on rendered planes: what the stub cannot show."""
import array
import ctypes
import gc
import os
import struct
import subprocess
import sys
import tempfile
import threading
import unittest
import weakref

import plane
from defrec import (
    DISPARITY_NONE,
    DISPARITY_ONE,
    AlignParams,
    AlignStage,
    BusyError,
    Context,
    Error,
    Evidence,
    Format,
    LmParams,
    LmStage,
    LogLevel,
    MatchParams,
    MatchStage,
    Motion,
    Observation,
    OrbParams,
    Piece,
    OrbStage,
    RansacParams,
    RansacStage,
    Reason,
    RectifyParams,
    RectifyStage,
    Rig,
    State,
    Status,
    StereoParams,
    StereoStage,
    SurfaceSample,
    Template,
    Tracker,
    View,
    WarpParams,
    WarpStage,
)
from defrec._arrays import numpy

FRAMES = [plane.pair(shift) for shift in range(4)]
SIZE = dict(width=plane.WIDTH, height=plane.HEIGHT)
CENTRE = [(plane.CAMERA.cx, plane.CAMERA.cy)]


def raw(values):
    """An array's bytes, to compare exactly."""
    return bytes(memoryview(values).cast("B")) if len(values) > 0 else b""


class LibraryTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.context = Context(threads=2)
        cls.rig = Rig.rectified(cls.context, plane.WIDTH, plane.HEIGHT, plane.CAMERA)

    @classmethod
    def tearDownClass(cls):
        cls.rig.close()
        cls.context.close()

    def tracker(self, **options):
        made = Tracker(self.context, self.rig, "cpu", format=Format.GRAY8, **options)
        self.addCleanup(made.close)
        return made


class Tracking(LibraryTest):
    def test_devices(self):
        cpu = next(device for device in self.context.devices if device.id == "cpu")
        self.assertEqual(len(cpu.stages), 8)
        self.assertTrue(all(plugin.verdict == Status.OK for plugin in self.context.plugins))

    def test_a_plane_lies_where_it_is(self):
        tracker = self.tracker(keep_disparity=True)
        lifted = None
        for frame, (left, right) in enumerate(FRAMES):
            with tracker.submit(left, right, frame * 33_000_000) as job:
                result = job.result()
                self.assertEqual(result.state, State.TRACKING)
                self.assertEqual((result.frame, result.timestamp_ns), (frame, frame * 33_000_000))
                if lifted is None:
                    lifted = tracker.template().lift(CENTRE)
                    self.assertEqual(lifted.found.tolist(), [True])
                moved = job.warp_points(lifted.xyz)
                x, y, z = moved.xyz.tolist()[0]
                self.assertAlmostEqual(x, -frame * plane.DEPTH_MM / plane.CAMERA.fx, delta=0.2)
                self.assertAlmostEqual(y, 0, delta=0.2)
                self.assertAlmostEqual(z, plane.DEPTH_MM, delta=0.5)
                errors = job.point_covariances(lifted.xyz)
                covariance = errors.covariance.tolist()[0]
                trace = covariance[0] + covariance[3] + covariance[5]
                self.assertAlmostEqual(trace**0.5, moved.expected_error_mm.tolist()[0], places=5)
                self.assertTrue(errors.evidence.tolist()[0] & Evidence.DEPTH)
                self.assertEqual(len(result.vertices), len(result.vertex_status))
                self.assertEqual(len(result.vertices), len(result.vertex_covariance))
                self.assertTrue(
                    any(seen & Evidence.DEPTH for seen in result.vertex_evidence.tolist())
                )
                self.assertEqual(
                    (len(result.pieces), Piece.from_buffer_copy(result.pieces).state),
                    (1, State.TRACKING),
                )
                self.assertEqual(result.disparity.shape, (plane.HEIGHT, plane.WIDTH))
                self.assertEqual(result.disparity[72, 96], plane.DISPARITY * DISPARITY_ONE)
        self.assertEqual(result.times[0].name, "upload")

    def test_fallback_is_another_device_only_where_it_was_asked_for(self):
        folder = os.environ["MISBEHAVING"]
        misbehave = ctypes.CDLL(
            os.path.join(folder, "defrec_plugin_misbehaving.so")
        ).defrec_misbehave
        with Context([folder], threads=2) as context:
            rig = Rig.rectified(context, plane.WIDTH, plane.HEIGHT, plane.CAMERA)
            misbehave(b"throw", b"device_open")
            self.addCleanup(misbehave, b"", b"")
            with self.assertRaises(Error) as raised:
                Tracker(context, rig, "misbehaving", format=Format.GRAY8)
            self.assertEqual(raised.exception.status, Status.ERROR_PLUGIN)
            with (
                rig,
                Tracker(context, rig, "misbehaving", format=Format.GRAY8, fallback=True) as tracker,
            ):
                device = tracker.track(*FRAMES[0], 0).device_id
            self.assertIn(device, {each.id for each in context.devices} - {"misbehaving"})

    def test_trackers_are_spread_over_the_devices_of_a_backend(self):
        with Context([os.environ["SEVERAL_DEVICES"]], threads=2) as context:
            with Rig.rectified(context, plane.WIDTH, plane.HEIGHT, plane.CAMERA) as rig:
                trackers = [
                    Tracker(context, rig, "several_devices:*", format=Format.GRAY8)
                    for _ in range(3)
                ]
                devices = [tracker.track(*FRAMES[0], 0).device_id for tracker in trackers]
                for tracker in trackers:
                    tracker.close()
        self.assertEqual(devices, [f"several_devices:{number}" for number in (0, 2, 0)])

    def test_process_is_submit_and_wait(self):
        alone = self.tracker()
        expected = [
            raw(alone.track(left, right, i).vertices) for i, (left, right) in enumerate(FRAMES)
        ]
        for frames_in_flight in (0, 3):
            ahead = self.tracker(frames_in_flight=frames_in_flight)
            found = []
            for job in ahead.process((left, right, i) for i, (left, right) in enumerate(FRAMES)):
                found.append(raw(job.result().vertices))
                last = job
            self.assertEqual(found, expected)
            self.assertTrue(last.is_closed)

    def test_process_left_early_gives_the_queue_back(self):
        tracker = self.tracker(frames_in_flight=2)
        for job in tracker.process((*plane.pair(), i) for i in range(9)):
            break
        job.close()
        gc.collect()
        tracker.track(*plane.pair(), 100)

    def test_refusals(self):
        tracker = self.tracker(frames_in_flight=1)
        left, right = FRAMES[0]
        with self.assertRaises(Error) as caught:
            tracker.template()
        self.assertIs(caught.exception.status, Status.ERROR_STATE)
        job = tracker.submit(left, right, 5)
        with self.assertRaises(BusyError):
            tracker.submit(left, right, 6)
        job.close()
        with self.assertRaisesRegex(Error, "timestamp"):
            tracker.submit(left, right, 5)
        with self.assertRaisesRegex(Error, "no_such_device"):
            Tracker(self.context, self.rig, "no_such_device")
        with self.assertRaises(Error) as caught:
            Template.load(self.context, os.devnull)
        self.assertIs(caught.exception.status, Status.ERROR_IO)

    def test_templates_are_kept(self):
        first = self.tracker()
        first.track(*FRAMES[0], 1)
        with tempfile.TemporaryDirectory() as folder, first.template() as template:
            path = os.path.join(folder, "tämplate")
            template.save(path)
            with Template.load(self.context, path) as loaded:
                data, same = template.data(), loaded.data()
                second = self.tracker()
                second.set_template(loaded)
        for name in ("vertices", "triangles", "nodes", "edges", "landmarks", "patches", "image"):
            self.assertGreater(len(getattr(data, name)), 0, name)
            self.assertEqual(raw(getattr(data, name)), raw(getattr(same, name)), name)
        self.assertEqual((data.size, data.camera), ((plane.WIDTH, plane.HEIGHT), plane.CAMERA))
        self.assertEqual(data.image.shape, (plane.HEIGHT, plane.WIDTH))
        self.assertLess(
            max(max(triangle) for triangle in data.triangles.tolist()), len(data.vertices)
        )
        self.assertIn(second.track(*FRAMES[1], 1).state, (State.TRACKING, State.RELOCALISED))

    def test_a_cut_is_told_by_its_points(self):
        first = self.tracker()
        first.track(*FRAMES[0], 1)
        with tempfile.TemporaryDirectory() as folder, first.template() as template:
            path = os.path.join(folder, "template")
            template.save(path)
            self.assertEqual(len(template.data().cut_points), 0)
            with open(path, "rb") as file:
                whole = file.read()[:-8]
            # The file ends in the number of cuts and in a flag, 0 without a body: one cut is put
            # in.
            line = [(plane.WIDTH / 2, plane.HEIGHT / 2 + v) for v in (-20, 0, 20)]
            cuts = struct.pack("<QBQ6fB", 1, 0, 3, *(x for pixel in line for x in pixel), 0)
            parted = whole[:-9] + cuts
            checksum = 1469598103934665603
            for byte in parted:
                checksum = ((checksum ^ byte) * 1099511628211) % 2**64
            with open(path, "wb") as file:
                file.write(parted + struct.pack("<Q", checksum))
            with Template.load(self.context, path) as loaded:
                points = list(struct.iter_unpack("<3fI", raw(loaded.data().cut_points)))
        self.assertEqual([cut for *_, cut in points], [0, 0, 0])
        for (x, y, z, _), (u, v) in zip(points, line):
            self.assertAlmostEqual(plane.CAMERA.fx * x / z + plane.CAMERA.cx, u, places=3)
            self.assertAlmostEqual(plane.CAMERA.fy * y / z + plane.CAMERA.cy, v, places=3)

    def test_memory_is_as_good_as_pixels(self):
        copied, imported = self.tracker(), self.tracker()
        left, right = (bytearray(image) for image in FRAMES[0])
        memories = imported.import_memory(left), imported.import_memory(right)
        samples = (SurfaceSample * 10000)()
        surface = imported.import_memory(samples)
        for frame, (left_pixels, right_pixels) in enumerate(FRAMES):
            left[:], right[:] = left_pixels, right_pixels
            result = imported.track(*memories, frame, samples=surface)
            self.assertEqual(
                raw(result.vertices), raw(copied.track(left_pixels, right_pixels, frame).vertices)
            )
        for index, vertex in enumerate(result.vertices.tolist()):
            self.assertEqual(list(samples[index].position), vertex)
        for memory in (*memories, surface):
            memory.close()
        with self.assertRaisesRegex(Error, "16"):
            imported.import_memory(memoryview(left)[1:])

    def test_ignored_pixels(self):
        tracker = self.tracker()
        left, right = FRAMES[0]
        half = (b"\0" * (plane.WIDTH // 2) + b"\1" * (plane.WIDTH // 2)) * plane.HEIGHT
        tracker.track(left, right, 1, ignore=half)
        xs = [vertex[0] for vertex in tracker.track(left, right, 2).vertices.tolist()]
        self.assertLess(max(xs), plane.DEPTH_MM * 0.2)

    def test_the_view_that_is_black_is_named(self):
        tracker = self.tracker()
        left, right = FRAMES[0]
        self.assertEqual(tracker.track(left, right, 1).faulty_views, View(0))
        result = tracker.track(left, bytes(len(right)), 2)
        self.assertEqual(result.faulty_views, View.RIGHT)
        self.assertTrue(result.reasons & Reason.ONE_VIEW)

    @unittest.skipIf(numpy is None, "needs NumPy")
    def test_numbers_of_numpy_as_the_error_of_a_disparity(self):
        def error(sigma):
            given = numpy.full((plane.HEIGHT, plane.WIDTH), plane.DISPARITY, numpy.float32)
            result = self.tracker().track(*FRAMES[0], 1, disparity=given, disparity_sigma=sigma)
            return result.expected_error_mm[0]

        self.assertEqual(error(numpy.float32(0.5)), error(0.5))
        self.assertEqual(error(numpy.int64(1)), error(1))

    def test_disparity_of_the_application(self):
        left, right = FRAMES[0]
        options = dict(keep_disparity=True)
        row = array.array("f", [plane.DISPARITY + 0.25] * plane.WIDTH)
        given = memoryview(row * plane.HEIGHT).cast("B").cast("f", (plane.HEIGHT, plane.WIDTH))
        one = self.tracker(**options).track(left, right, 1, disparity=given, disparity_sigma=0.1)
        self.assertEqual(one.state, State.TRACKING)
        self.assertEqual(one.disparity[0, 0], plane.DISPARITY * DISPARITY_ONE + 4)
        sigma = memoryview(array.array("f", [0.5] * (plane.WIDTH * plane.HEIGHT)))
        sigma = sigma.cast("B").cast("f", (plane.HEIGHT, plane.WIDTH))
        other = self.tracker(**options).track(
            left, right, 1, disparity=given, disparity_sigma=sigma
        )
        self.assertEqual(one.vertices.tolist(), other.vertices.tolist())
        self.assertLess(one.expected_error_mm[0], other.expected_error_mm[0])

        wrong = memoryview(array.array("f", [8] * (plane.WIDTH * plane.HEIGHT)))
        wrong = wrong.cast("B").cast("f", (plane.HEIGHT, plane.WIDTH))
        refuted = self.tracker().track(left, right, 1, disparity=wrong, disparity_sigma=0.1)
        self.assertEqual(refuted.state, State.INITIALISING)
        self.assertTrue(refuted.reasons & Reason.DISPARITY)

        tracker = self.tracker()
        rows = [[plane.DISPARITY] * plane.WIDTH] * plane.HEIGHT
        for disparity, deviation, words in (
            (rows[:-1], 0.1, "143 rows, 144 expected"),
            ([row[:-1] for row in rows], 0.1, "disparity"),
            (rows, None, "disparity_sigma"),
            (rows, rows[:-1], "disparity_sigma has 143 rows"),
            (None, 0.1, "without disparity"),
        ):
            with self.assertRaisesRegex(ValueError, words):
                tracker.submit(left, right, 1, disparity=disparity, disparity_sigma=deviation)
        with self.assertRaisesRegex(Error, "sigma_px is 0"):
            tracker.submit(left, right, 1, disparity=rows, disparity_sigma=0)
        rows[7] = [-1] * plane.WIDTH
        with self.assertRaisesRegex(Error, r"pixel \(0, 7\) is -1"):
            tracker.submit(left, right, 1, disparity=rows, disparity_sigma=0.1)


class Stages(LibraryTest):
    def test_all_eight(self):
        rectify = RectifyStage(
            self.context,
            RectifyParams(
                format=Format.GRAY8, source_width=plane.WIDTH, source_height=plane.HEIGHT
            ),
        )
        left, mask = rectify.run(FRAMES[0][0])
        right, _ = rectify.run(FRAMES[0][1])
        self.assertEqual((left.shape, raw(left)), ((plane.HEIGHT, plane.WIDTH), FRAMES[0][0]))
        disparity, confidence = StereoStage(self.context, StereoParams(**SIZE)).run(
            left, right, mask
        )
        self.assertEqual(
            (disparity[72, 96], disparity[0, 0]), (plane.DISPARITY * DISPARITY_ONE, DISPARITY_NONE)
        )
        self.assertGreater(confidence[72, 96], 0)
        features = OrbStage(self.context, OrbParams(**SIZE)).run(left, mask)
        self.assertGreater(len(features), 50)

        tracker = self.tracker()
        tracker.track(*FRAMES[0], 1)
        data = tracker.template().data()
        camera = data.camera
        match = MatchStage(
            self.context, MatchParams(landmarks=4096, features=len(features), camera=camera, **SIZE)
        )
        match.prepare(data.landmarks)
        matches = match.run(features, disparity)
        self.assertEqual(len(matches), len(data.landmarks))
        ransac = RansacStage(self.context, RansacParams(landmarks=4096, seed=7))
        ransac.prepare(data.landmarks)
        matches, summary = ransac.run(matches)
        self.assertGreater(summary.inliers, len(data.landmarks) // 2)

        nodes = len(data.nodes)
        rest = [Motion(real=(1, 0, 0, 0)) for _ in range(nodes)]
        align = AlignStage(
            self.context, AlignParams(patches=4096, nodes=nodes, camera=camera, **SIZE)
        )
        align.prepare(data.patches, data.image)
        observations, predictions = align.run(left, mask, motions=rest)
        self.assertEqual(
            (len(observations), len(predictions)), (len(data.patches), len(data.patches))
        )
        again = align.run(left, mask, predictions=predictions)
        self.assertEqual(raw(again.observations), raw(observations))

        counts = dict(
            nodes=nodes,
            edges=len(data.edges),
            points=len(data.vertices),
            landmarks=0,
            patches=len(data.patches),
        )
        lm = LmStage(self.context, LmParams(camera=camera, **counts, **SIZE))
        lm.prepare(data.nodes, data.edges, data.vertices, [], data.patches)
        motions, solved = lm.run(rest, None, observations, disparity)
        self.assertEqual((len(motions), solved.failed), (nodes, 0))
        self.assertLessEqual(solved.final_cost, solved.initial_cost)

        warp = WarpStage(
            self.context, WarpParams(nodes=nodes, points=len(data.vertices), camera=camera, **SIZE)
        )
        warp.prepare(data.vertices)
        samples = (SurfaceSample * len(data.vertices)).from_buffer_copy(
            raw(warp.run(motions, disparity))
        )
        self.assertGreater(
            sum(sample.observation == Observation.OBSERVED for sample in samples), len(samples) // 2
        )

    def test_not_prepared(self):
        match = MatchStage(
            self.context, MatchParams(landmarks=4, features=4, camera=plane.CAMERA, **SIZE)
        )
        with self.assertRaises(Error) as caught:
            match.run([], memoryview(bytearray(2 * plane.WIDTH * plane.HEIGHT)).cast("h"))
        self.assertIs(caught.exception.status, Status.ERROR_STATE)

    def test_too_small(self):
        stereo = StereoStage(self.context, StereoParams(**SIZE))
        with self.assertRaisesRegex(Error, "are needed"):
            stereo.run_buffers(FRAMES[0], [bytearray(9)])


class Callbacks(unittest.TestCase):
    def test_log_survives_collection(self):
        received = []

        def log(level, source, text):
            received.append((level, source, text))

        context = Context(log=log, log_level=LogLevel.DEBUG)
        rig = Rig.rectified(context, plane.WIDTH, plane.HEIGHT, plane.CAMERA)
        tracker = Tracker(context, rig, "cpu", format=Format.GRAY8)
        function = weakref.ref(log)
        del log
        gc.collect()
        tracker.track(*FRAMES[0], 1)
        with tempfile.TemporaryDirectory() as folder, tracker.template() as template:
            template.save(os.path.join(folder, "template"))
            received.clear()
            Template.load(context, os.path.join(folder, "template")).close()
        self.assertEqual(
            [(level, source) for level, source, _ in received], [(LogLevel.INFO, "sdk")]
        )
        self.assertIn("template with", received[0][2])
        del context, rig, template
        gc.collect()
        self.assertIsNotNone(function(), "the tracker may still log")
        tracker.track(*FRAMES[1], 2)
        tracker.close()
        gc.collect()
        self.assertIsNone(function())

    def test_exceptions_end_in_the_callback(self):
        def log(level, source, text):
            raise RuntimeError("from the log")

        raised = []
        previous, sys.unraisablehook = sys.unraisablehook, lambda unraisable: raised.append(
            unraisable.exc_value
        )
        try:
            with tempfile.TemporaryDirectory() as folder:
                with open(os.path.join(folder, "bad.json"), "w") as manifest:
                    manifest.write("{")
                context = Context([os.path.join(folder, "bad.json")], log=log)
        finally:
            sys.unraisablehook = previous
        self.assertEqual({str(error) for error in raised}, {"from the log"})
        refused = [plugin for plugin in context.plugins if plugin.verdict < 0]
        self.assertEqual(len(refused), 1)
        self.assertIn("bad.json", refused[0].path)


class Threads(LibraryTest):
    def test_trackers_of_their_own(self):
        def track(found):
            tracker = Tracker(self.context, self.rig, "cpu", format=Format.GRAY8)
            for frame, (left, right) in enumerate(FRAMES):
                found.append(raw(tracker.track(left, right, frame).vertices))

        expected = []
        track(expected)
        results = [[] for _ in range(4)]
        threads = [threading.Thread(target=track, args=(found,)) for found in results]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(results, [expected] * 4)

    def test_one_job_of_many_threads(self):
        job = self.tracker().submit(*FRAMES[0], 1)
        found = []
        threads = [
            threading.Thread(target=lambda: found.append(raw(job.result().vertices)))
            for _ in range(4)
        ]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(len(found), 4)
        self.assertEqual(len(set(found)), 1)

    def test_closed_while_others_wait(self):
        tracker = self.tracker(frames_in_flight=4)
        jobs = [tracker.submit(*FRAMES[i], i) for i in range(4)]
        ends = []

        def wait(job):
            try:
                ends.append(job.wait())
            except Error as error:
                ends.append(error.status)

        threads = [threading.Thread(target=wait, args=(job,)) for job in jobs]
        for thread in threads:
            thread.start()
        tracker.close()
        for thread in threads:
            thread.join()
        self.assertTrue(set(ends) <= {True, Status.ERROR_STATE}, ends)

    def test_left_to_the_end_of_the_process(self):
        """Nothing closed, frames queued: the process ends without a crash."""
        code = (
            "import defrec, plane\n"
            "context = defrec.Context(log=print, log_level=defrec.LogLevel.DEBUG)\n"
            "rig = defrec.Rig.rectified(context, plane.WIDTH, plane.HEIGHT, plane.CAMERA)\n"
            "tracker = defrec.Tracker(context, rig, 'cpu', format=defrec.Format.GRAY8)\n"
            "jobs = [tracker.submit(*plane.pair(i), i) for i in range(2)]\n"
        )
        subprocess.run(
            [sys.executable, "-c", code], check=True, cwd=os.path.dirname(plane.__file__)
        )

    def test_fork(self):
        """The child's handles answer with an error, closing them does nothing, and the parent goes
        on."""
        code = (
            "import defrec, os, plane\n"
            "context = defrec.Context()\n"
            "rig = defrec.Rig.rectified(context, plane.WIDTH, plane.HEIGHT, plane.CAMERA)\n"
            "tracker = defrec.Tracker(context, rig, 'cpu', format=defrec.Format.GRAY8)\n"
            "job = tracker.submit(*plane.pair(), 0)\n"
            "child = os.fork()\n"
            "if child == 0:\n"
            "    try:\n"
            "        tracker.submit(*plane.pair(), 1)\n"
            "    except defrec.Error as error:\n"
            "        assert error.status == defrec.Status.ERROR_STATE, error\n"
            "        with defrec.Context() as another:\n"
            "            assert another.devices\n"
            "        raise SystemExit(7)\n"
            "else:\n"
            "    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7\n"
            "    assert job.result().state == defrec.State.TRACKING\n"
        )
        subprocess.run(
            [sys.executable, "-c", code],
            check=True,
            cwd=os.path.dirname(plane.__file__),
            timeout=120,
        )


if __name__ == "__main__":
    unittest.main()
