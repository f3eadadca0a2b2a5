"""What cannot be passed to the library raises, with the argument's name, and nothing reaches the
library. Against the stub."""
import array
import unittest

import stub
from defrec import (
    AlignParams,
    AlignStage,
    BodyRegion,
    Camera,
    Context,
    Edge,
    Error,
    Feature,
    Format,
    Landmark,
    LmParams,
    LmStage,
    MatchParams,
    MatchStage,
    MemoryKind,
    Motion,
    OrbParams,
    OrbStage,
    Patch,
    RansacParams,
    RansacStage,
    Rig,
    RectifyParams,
    RectifyStage,
    Stage,
    StereoParams,
    StereoStage,
    SurfacePoint,
    Targets,
    Template,
    Tracker,
    WarpParams,
    WarpStage,
    detect_scan,
    status_name,
)
from defrec._arrays import Points, numpy

CAMERA = Camera(fx=500, fy=500, cx=50, cy=40, baseline_mm=4.5)
MATRIX = [[500, 0, 50], [0, 500, 40], [0, 0, 1]]
W, H = 96, 80
IMAGE = bytes(W * H * 3)
GRAY = bytes(W * H)


def shaped(code, *shape):
    size = array.array(code if code != "?" else "B").itemsize
    for length in shape:
        size *= length
    return memoryview(bytearray(size)).cast(code, shape)


class Arguments(stub.StubTest):
    def setUp(self):
        super().setUp()
        self.context = Context()
        self.rig = Rig.rectified(self.context, W, H, CAMERA)
        self.tracker = Tracker(self.context, self.rig)
        self.job = self.tracker.submit(IMAGE, IMAGE, 1)
        stub.calls()

    def refuses(self, kinds, names, attempt, *arguments):
        """names: a word, or words, of the error message."""
        with self.assertRaises(kinds) as caught:
            attempt(*arguments)
        for name in [names] if isinstance(names, str) else names:
            self.assertIn(name, str(caught.exception))
        reached = [
            call for call in stub.calls() if not call.function.endswith(("_destroy", "_release"))
        ]
        self.assertEqual(reached, [])

    def test_names_of_options(self):
        self.refuses(
            TypeError,
            ["__init__() got an unexpected", "'bakend'"],
            lambda: Tracker(self.context, self.rig, bakend=1),
        )
        self.assertEqual(Tracker.__init__.__qualname__, "Tracker.__init__")

    def test_rigs_and_trackers_say_what_they_are(self):
        self.assertEqual(repr(self.rig), "<Rig of 96x80 images>")
        self.assertEqual(repr(self.tracker), "<Tracker of 96x80 BGR8 images>")
        self.tracker.close()
        self.assertEqual(repr(self.tracker), "<Tracker of 96x80 BGR8 images, closed>")

    def test_images(self):
        def submit(left):
            return self.tracker.submit(left, IMAGE, 2)

        for bad in (None, 5, "text", [1, 2, 3], [IMAGE], object()):
            self.refuses(TypeError, "left", submit, bad)
        self.refuses(ValueError, ["left", "(80, 96, 3)"], submit, shaped("B", H, W))
        self.refuses(ValueError, ["left", "(96, 80, 3)"], submit, shaped("B", W, H, 3))
        self.refuses(ValueError, "left", submit, shaped("B", H, W, 4))
        self.refuses(ValueError, "left", submit, shaped("B", 1, H, W, 3))
        self.refuses(ValueError, ["left", "23040"], submit, IMAGE[:-1])
        self.refuses(ValueError, "left", submit, IMAGE + b"\0")
        self.refuses(ValueError, "left", submit, b"")
        self.refuses(TypeError, ["left", "float64"], submit, shaped("d", H, W, 3))
        self.refuses(TypeError, ["left", "float32"], submit, shaped("f", W * H * 3))
        self.refuses(TypeError, "left", submit, shaped("b", H, W, 3))
        self.refuses((TypeError, ValueError), "left", submit, memoryview(IMAGE + IMAGE)[::2])
        self.refuses((TypeError, ValueError), "left", submit, memoryview(IMAGE)[::-1])
        self.refuses((TypeError, ValueError), "right", lambda: self.tracker.submit(IMAGE, None, 2))
        self.refuses(
            ValueError,
            ["ignore", "(80, 96)"],
            lambda: self.tracker.submit(IMAGE, IMAGE, 2, ignore=shaped("B", W, H)),
        )
        self.refuses(
            TypeError,
            "ignore",
            lambda: self.tracker.submit(IMAGE, IMAGE, 2, ignore=shaped("h", H, W)),
        )
        self.refuses(
            TypeError, "samples", lambda: self.tracker.submit(IMAGE, IMAGE, 2, samples=IMAGE)
        )
        self.tracker.submit(IMAGE, IMAGE, 2, ignore=shaped("?", H, W))

    @unittest.skipIf(numpy is None, "needs NumPy")
    def test_numpy_images(self):
        def submit(left):
            return self.tracker.submit(left, IMAGE, 2)

        wide = numpy.zeros((H, 2 * W, 3), numpy.uint8)
        self.refuses(ValueError, "ascontiguousarray", submit, wide[:, ::2])
        self.refuses(ValueError, "ascontiguousarray", submit, wide[:, :W, ::-1])
        self.refuses(ValueError, "ascontiguousarray", submit, wide[::-1, :W])
        self.refuses(
            ValueError,
            "ascontiguousarray",
            submit,
            numpy.zeros((W, H, 3), numpy.uint8).transpose(1, 0, 2),
        )
        self.refuses(
            ValueError,
            "ascontiguousarray",
            submit,
            numpy.asfortranarray(numpy.zeros((H, W, 3), numpy.uint8)),
        )
        self.refuses(
            ValueError, "ascontiguousarray", submit, numpy.broadcast_to(wide[:1, :W], (H, W, 3))
        )
        for dtype in (numpy.int8, numpy.uint16, numpy.float32, bool, object, "datetime64[s]", "S1"):
            self.refuses(TypeError, "left", submit, numpy.zeros((H, W, 3), dtype))
        read_only = wide[:, W:]
        read_only.flags.writeable = False
        submit(read_only)

    def test_timestamps(self):
        for bad in (1.5, None, "1", 1 << 63, -(1 << 63) - 1):
            self.refuses(
                (TypeError, ValueError), "timestamp_ns", self.tracker.submit, IMAGE, IMAGE, bad
            )

    def test_timeouts(self):
        template = self.tracker.template()
        stub.calls()
        for bad in (-1, float("nan")):
            self.refuses(ValueError, "timeout", self.job.wait, bad)
            self.refuses(ValueError, "timeout", template.wait_body, bad)
        self.assertTrue(self.job.wait(float("inf")))
        self.assertTrue(self.job.wait(1e300))
        self.assertEqual({call.arguments["timeout_ns"] for call in stub.calls()}, {"100000000"})

    def test_points(self):
        for bad in (
            None,
            5,
            "text",
            [1, 2, 3],
            [(1, 2)],
            [(1, 2, 3, 4)],
            [(1, 2, "x")],
            [(1, 2, None)],
            [[(1, 2, 3)]],
            [(1, 2, 3), (4, 5)],
            [(1j, 2, 3)],
        ):
            self.refuses((TypeError, ValueError), "template_xyz", self.job.warp_points, bad)
            self.refuses((TypeError, ValueError), "template_xyz", self.job.point_covariances, bad)
        for bad in ([(1, 2, 3)], shaped("d", 6), array.array("d", [1, 2]), {1: 2}):
            self.refuses((TypeError, ValueError), "raw_uv", self.rig.rectify_pixels, bad)
        for good in (
            [(1, 2, 3)],
            ((1, 2, 3),),
            shaped("d", 1, 3),
            shaped("f", 1, 3),
            shaped("h", 1, 3),
        ):
            self.assertEqual(self.job.warp_points(good).xyz.tolist(), [[1, 2, 3]])
        empty = self.job.warp_points([])
        self.assertEqual(
            (len(empty.xyz), len(empty.status), len(empty.expected_error_mm)), (0, 0, 0)
        )
        self.assertIn("template_xyz=[], count=0", stub.lines()[-1])
        self.assertEqual([len(part) for part in self.job.point_covariances([])], [0, 0])

    def test_targets(self):
        template = self.tracker.template()
        stub.answer("defrec_targets_count", 1)
        targets = Targets(template, [(1, 2, 3)])
        stub.calls()
        self.refuses(TypeError, "template", Targets, None, [(1, 2, 3)])
        self.refuses(TypeError, "template", Targets, self.tracker, [(1, 2, 3)])
        for bad in (
            None,
            5,
            [1, 2, 3],
            [(1, 2)],
            [(1, 2, 3, 4)],
            [(1, 2, "x")],
            [(1, 2, 3), (4, 5)],
        ):
            self.refuses((TypeError, ValueError), "template_xyz", Targets, template, bad)
        for bad in (None, template, [(1, 2, 3)]):
            self.refuses(TypeError, "targets", self.job.move_targets, bad)
        self.assertEqual(len(self.job.move_targets(targets).xyz), 1)
        stub.answer("defrec_targets_count", 0)
        with Targets(template, []) as none:
            self.assertTrue(none)
            self.assertEqual([len(part) for part in self.job.move_targets(none)], [0, 0, 0, 0])
        self.assertIn("template_xyz=[], count=0", stub.lines()[2])
        targets.close()
        with self.assertRaisesRegex(Error, "Targets is closed"):
            self.job.move_targets(targets)

    def test_bodies(self):
        template = self.tracker.template()
        stub.calls()
        good = [(0, 0, 50), (9, 0, 50), (0, 9, 50)], [(0, 1, 2)]
        for bad in (5, "mesh", [], [1, 2, 3], good[0]):
            self.refuses((TypeError, ValueError), "mesh", template.set_body, bad)
        for bad in (None, 5, [1, 2, 3], [(1, 2)], [(1, 2, "x")], [(1, 2, 3), (4, 5)]):
            self.refuses(
                (TypeError, ValueError), "mesh.vertices", template.set_body, (bad, good[1])
            )
            self.refuses(
                (TypeError, ValueError), "mesh.triangles", template.set_body, (good[0], bad)
            )
        for bad in ([(0, 1, -1)], [(0, 1, 1 << 32)], [(0, 1, 0.5)], [(0.0, 1.0, 2.0)]):
            self.refuses(
                (TypeError, ValueError), "mesh.triangles", template.set_body, (good[0], bad)
            )
        region = BodyRegion(good)
        for bad in (None, 5, region, {region}):
            self.refuses(TypeError, "regions", template.set_body, None, bad)
        self.refuses(TypeError, "regions[1]", template.set_body, None, [region, good])
        self.refuses(
            (TypeError, ValueError),
            "regions[1].mesh.vertices",
            template.set_body,
            None,
            [region, BodyRegion(([1], []))],
        )
        self.refuses(
            TypeError, "stiffness", template.set_body, None, [BodyRegion(good, stiffness="x")]
        )
        self.refuses(TypeError, "poisson_ratio", lambda: template.set_body(poisson_ratio="x"))
        self.refuses(TypeError, "cut_depth_mm", lambda: template.set_body(cut_depth_mm=None))
        # What is a number is the library's to judge.
        template.set_body(([(float("nan"), 0, 1e300)], []), poisson_ratio=float("nan"))
        self.assertEqual(stub.calls()[0].function, "defrec_template_set_body")

    def test_motions(self):
        def submit(**motions):
            return self.tracker.submit(IMAGE, IMAGE, 2, **motions)

        good = [(1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0)]
        for name in ("held_motion", "camera_pose"):
            for bad in (
                5,
                "text",
                [],
                [1] * 12,
                good[:2],
                good + [(0, 0, 0, 1)],
                [row[:3] for row in good],
                [(1, 0, 0, "x")] * 3,
            ):
                self.refuses((TypeError, ValueError), name, lambda: submit(**{name: bad}))
            submit(**{name: [(float("nan"),) * 4] * 3}).close()
            # The collector may give objects of earlier tests back in between.
            reached = [
                call.function
                for call in stub.calls()
                if not call.function.endswith(("_destroy", "_release"))
            ]
            self.assertEqual(reached[0], "defrec_tracker_submit")

    @unittest.skipIf(numpy is None, "needs NumPy")
    def test_masks_are_not_dropped_in_silence(self):
        """Row 127."""

        def masked(*shape, dtype=float):
            return numpy.ma.masked_equal(numpy.zeros(shape, dtype), 0)

        image = masked(H, W, 3, dtype=numpy.uint8)
        self.refuses(TypeError, "filled", self.tracker.submit, image, IMAGE, 2)
        self.refuses(TypeError, "filled", self.job.warp_points, masked(2, 3))

    @unittest.skipIf(numpy is None, "needs NumPy")
    def test_numpy_points(self):
        for bad in (
            numpy.zeros(3),
            numpy.zeros((3, 2)),
            numpy.zeros((1, 1, 3)),
            numpy.zeros((1, 3), complex),
            numpy.zeros((1, 3), object),
        ):
            self.refuses((TypeError, ValueError), "template_xyz", self.job.warp_points, bad)
        strided = numpy.arange(24.0).reshape(4, 6)[::2, ::2]
        self.job.warp_points(strided)
        self.assertIn("template_xyz=[0, 2, 4, 12, 14, 16], count=2", stub.lines()[-1])
        self.assertEqual(self.job.warp_points(numpy.zeros((0, 3))).xyz.shape, (0, 3))
        misaligned = numpy.frombuffer(
            bytes(1) + numpy.arange(3.0).tobytes(), numpy.float64, offset=1
        ).reshape(1, 3)
        self.assertEqual(Points("xyz", misaligned, 3).address % 8, 0)
        self.job.warp_points(misaligned)
        self.assertIn("template_xyz=[0, 1, 2], count=1", stub.lines()[-1])

    def test_calibrations(self):
        good = [
            self.context,
            W,
            H,
            MATRIX,
            None,
            MATRIX,
            None,
            [1, 0, 0, 0, 1, 0, 0, 0, 1],
            [-4.5, 0, 0],
        ]
        names = ["context", "width", "height", "M1", "D1", "M2", "D2", "R", "T"]
        bad = {
            "context": [None, self.rig],
            "width": [None, -1, 1 << 32, 96.0],
            "height": ["80"],
            "M1": [
                None,
                [[1, 2], [3, 4]],
                "x",
                [[500, 1, 50], [0, 500, 40], [0, 0, 1]],
                [[500, 0, 50], [0, 500, 40], [0, 1, 0]],
                [MATRIX, MATRIX],
            ],
            "D1": [[1, 2, 3], [1, 2, 3, "x"], 0.5],
            "M2": [[1] * 9],
            "D2": [[0.0] * 15],
            "R": [None, [1, 2, 3]],
            "T": [[1, 2], [1, 2, 3, 4], None],
        }
        for index, name in enumerate(names):
            for value in bad[name]:
                given = list(good)
                given[index] = value
                self.refuses((TypeError, ValueError), name, Rig, *given)
        self.refuses(TypeError, "camera", Rig.rectified, self.context, W, H, (1, 2, 3, 4, 5))

    def test_contexts(self):
        self.refuses(TypeError, "plugin_paths", lambda: Context("/a"))
        self.refuses(TypeError, "plugin_paths", lambda: Context([5]))
        self.refuses(ValueError, "NUL", lambda: Context(["/a\0b"]))
        self.refuses(TypeError, "log", lambda: Context(log=5))
        self.refuses(ValueError, "threads", lambda: Context(threads=-1))

    def test_trackers(self):
        self.refuses(TypeError, "context", lambda: Tracker(None, self.rig))
        self.refuses(TypeError, "rig", lambda: Tracker(self.context, self.context))
        self.refuses(TypeError, "device_id", lambda: Tracker(self.context, self.rig, 5))
        self.refuses(ValueError, "NUL", lambda: Tracker(self.context, self.rig, "cpu\0"))
        self.refuses(ValueError, "format", lambda: Tracker(self.context, self.rig, format=9))
        self.refuses(ValueError, "format is 9", detect_scan, GRAY, GRAY, W, H, 9)
        self.refuses(TypeError, "seed", lambda: Tracker(self.context, self.rig, seed=1.5))
        self.refuses(ValueError, "seed", lambda: Tracker(self.context, self.rig, seed=1 << 64))
        self.refuses(
            TypeError, "arap_weight", lambda: Tracker(self.context, self.rig, arap_weight="x")
        )
        self.refuses(TypeError, "template", self.tracker.set_template, None)
        self.refuses(TypeError, "path", Template.load, self.context, None)
        for bad in (None, b"read only", 5):
            self.refuses(TypeError, "source", self.tracker.import_memory, bad)

    def test_numbers(self):
        self.refuses(ValueError, "status", status_name, 1 << 31)
        self.refuses(TypeError, "status", status_name, 1.5)
        self.refuses(
            ValueError, "address", self.tracker.import_memory_at, 1 << 64, 1, MemoryKind.HOST
        )
        self.refuses(ValueError, "size", self.tracker.import_memory_at, 16, -1, MemoryKind.HOST)
        self.refuses(TypeError, "fx", lambda: Camera(fx=10**400))
        self.refuses(
            TypeError,
            "D1",
            Rig,
            self.context,
            W,
            H,
            MATRIX,
            [10**400] * 4,
            MATRIX,
            None,
            [1] * 9,
            [1] * 3,
        )

    def test_parameters(self):
        self.refuses(AttributeError, "heigth", lambda: StereoParams(width=1, heigth=2))
        self.refuses(ValueError, "width", lambda: StereoParams(width=-1))
        self.refuses(TypeError, "width", lambda: StereoParams(width=1.5))
        params = OrbParams()
        self.refuses(ValueError, "levels", setattr, params, "levels", 1 << 32)
        self.refuses(AttributeError, "level", setattr, params, "level", 1)
        self.refuses(TypeError, "params", lambda: Stage(self.context, CAMERA))
        self.refuses(TypeError, "params", lambda: Stage(self.context, None))
        self.refuses(TypeError, "StereoParams", lambda: StereoStage(self.context, OrbParams()))
        self.refuses(
            ValueError,
            "stride",
            lambda: StereoStage(self.context, StereoParams(width=10, height=10, stride=12)),
        )

    def test_buffers(self):
        stage = Stage(self.context, OrbParams())
        stub.calls()
        for bad in (None, b"bytes", 5, bytearray(3)):
            self.refuses(TypeError, "inputs", stage.prepare_buffers, bad)
        self.refuses(TypeError, "inputs[1]", stage.prepare_buffers, [b"", 5])
        self.refuses(TypeError, ["outputs[0]", "writable"], stage.run_buffers, [], [b"read only"])
        self.refuses(
            (TypeError, ValueError),
            "outputs[0]",
            stage.run_buffers,
            [],
            [memoryview(bytearray(8))[::2]],
        )
        if numpy is not None:
            for dtype in (object, [("number", "f4"), ("reference", "O")]):
                objects = numpy.zeros(4, dtype)
                self.refuses(TypeError, ["outputs[0]", "objects"], stage.run_buffers, [], [objects])
                self.refuses(TypeError, ["source", "objects"], self.tracker.import_memory, objects)
            self.tracker.import_memory(numpy.zeros(4, [("Öl, O", "f4")]))
            stub.calls()

    def test_stages(self):
        p = dict(width=W, height=H)
        stereo = StereoStage(self.context, StereoParams(**p))
        orb = OrbStage(self.context, OrbParams(capacity=5, **p))
        match = MatchStage(self.context, MatchParams(landmarks=3, features=5, **p))
        ransac = RansacStage(self.context, RansacParams(landmarks=3))
        align = AlignStage(self.context, AlignParams(patches=3, nodes=2, views=2, **p))
        lm = LmStage(
            self.context, LmParams(nodes=2, edges=1, points=3, landmarks=4, patches=0, **p)
        )
        warp = WarpStage(self.context, WarpParams(nodes=2, points=3, **p))
        rectify = RectifyStage(
            self.context, RectifyParams(format=Format.BGR8, source_width=W, source_height=H)
        )
        stub.calls()
        self.refuses(ValueError, "left", stereo.run, GRAY[1:], GRAY)
        self.refuses(ValueError, "right", stereo.run, GRAY, shaped("B", W, H))
        self.refuses(ValueError, "left_mask", stereo.run, GRAY, GRAY, b"")
        self.refuses(TypeError, "right_mask", stereo.run, GRAY, GRAY, GRAY, 5)
        self.refuses(TypeError, "gray", orb.run, shaped("h", H, W))
        self.refuses(TypeError, "landmarks", match.prepare, shaped("d", 12))
        self.refuses(TypeError, "landmarks", match.prepare, [Feature()])
        self.refuses(ValueError, ["landmarks", "at most 3"], match.prepare, [Landmark()] * 4)
        self.refuses(ValueError, ["landmarks", "at most 3"], ransac.prepare, bytes(4 * 48))
        self.refuses(
            ValueError, ["patches", "at most 3"], align.prepare, [Patch()] * 4, shaped("B", 2, H, W)
        )
        self.refuses(TypeError, "features", match.run, bytes(49), shaped("h", H, W))
        self.refuses(TypeError, "disparity", match.run, [Feature()], shaped("B", H, W))
        self.refuses(ValueError, "disparity", match.run, [Feature()], shaped("h", W, H))
        self.refuses(ValueError, "views", align.prepare, b"", GRAY)
        self.refuses(ValueError, "motions", lambda: align.run(GRAY, motions=[Motion()]))
        self.refuses(ValueError, "nodes", lm.prepare, shaped("f", 1, 3), [Edge()], [], [], [])
        self.refuses(TypeError, "nodes", lm.prepare, shaped("d", 2, 3), [Edge()], [], [], [])
        self.refuses(
            ValueError, "points", lm.prepare, shaped("f", 2, 3), [Edge()], [SurfacePoint()], [], []
        )
        self.refuses(ValueError, "motions", lm.run, [Motion()])
        self.refuses(ValueError, "matches", lm.run, [Motion()] * 2, [])
        self.refuses(ValueError, "points", warp.prepare, [SurfacePoint()])
        self.refuses(ValueError, "motions", warp.run, [])
        self.refuses(ValueError, "source", rectify.run, GRAY)
        self.refuses(ValueError, "map", rectify.run, IMAGE, shaped("i", W, H, 2))
        self.refuses(
            ValueError,
            "format",
            lambda: RectifyStage(self.context, RectifyParams(source_width=W, source_height=H)),
        )

        match.prepare([Landmark(), Landmark()])
        self.assertEqual(len(match.run([Feature()], shaped("h", H, W))), 2)
        self.assertEqual(
            stub.lines()[-1].split(", ", 1)[1],
            f"in=[4, 48, {2 * W * H}], in_count=3, out=[80], out_count=1)",
        )
        gray, mask = rectify.run(IMAGE)
        self.assertEqual((gray.shape, mask.shape), ((H, W), (H, W)))


if __name__ == "__main__":
    unittest.main()
