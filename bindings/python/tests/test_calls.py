"""Every function of the C API, called once through the binding with distinctive values: the stub
received each of them, in its place."""
import ctypes
import dataclasses
import gc
import pathlib
import signal
import unittest
from unittest import mock

import defrec
import stub
from defrec import (
    TRACKER_FALLBACK,
    BodyRegion,
    BusyError,
    Camera,
    Context,
    Field,
    Format,
    LogLevel,
    MemoryKind,
    Mesh,
    OrbParams,
    Plan,
    PlanPart,
    Registration,
    Result,
    Rig,
    Scan,
    Stage,
    StageKind,
    Status,
    StereoParams,
    Targets,
    Template,
    Tracker,
    _library,
    detect_scan,
    library_release,
    library_version,
    status_name,
    structs,
)
from defrec._arrays import numpy
from defrec.result import copy_result
from defrec.stage import KIND_OF_PARAMS
from description import CONTRACT, STRUCTS, argument

CAMERA = Camera(fx=500.5, fy=501.5, cx=50.25, cy=40.25, baseline_mm=4.5)


def make_rig(context):
    return Rig.rectified(context, 96, 80, CAMERA)


# What the stub writes down for a struct that it fills.
WRITTEN = {name: f"{{{struct['size']}}}" for name, struct in STRUCTS.items()}


class Calls(stub.StubTest):
    def setUp(self):
        super().setUp()
        self.context = Context()
        self.c = hex(self.context._native)
        stub.calls()

    def log(self):
        return stub.calls()

    def test_library(self):
        stub.answer("defrec_version", 3007)
        stub.answer("defrec_version_string", 0, "3.7.1")
        self.assertEqual(library_version(), (3, 7))
        self.assertEqual(library_release(), "3.7.1")
        self.assertEqual(defrec.__version__, "stub")  # read when the package was imported
        stub.answer("defrec_status_name", 0, "DEFREC_ERROR_IO")
        self.assertEqual(status_name(Status.ERROR_IO), "DEFREC_ERROR_IO")
        self.assertEqual(
            [str(call) for call in self.log()],
            ["defrec_version()", "defrec_version_string()", "defrec_status_name(status=-7)"],
        )

    def test_context(self):
        def log(level, source, text):
            pass

        with Context(
            ["/a/b", pathlib.Path("/c")],
            only_given_plugins=True,
            log=log,
            log_level=LogLevel.ERROR,
            threads=3,
        ) as context:
            handle = hex(context._native)
        with Context(use_environment=True):
            pass
        created, destroyed, second, _ = self.log()
        desc = created.struct("desc", structs.ContextDesc)
        self.assertEqual(
            (desc.flags, desc.plugin_path_count, desc.log_level, desc.threads), (1, 2, 4, 3)
        )
        self.assertTrue(desc.plugin_paths and desc.log)
        self.assertFalse(
            desc.log_user
            or desc.alloc
            or desc.free
            or desc.alloc_user
            or desc.parallel_for
            or desc.parallel_for_user
        )
        self.assertEqual(created.arguments["out"], handle)
        self.assertEqual(str(destroyed), f"defrec_context_destroy(context={handle})")
        self.assertEqual(second.struct("desc", structs.ContextDesc).flags, 2)
        self.assertFalse(second.struct("desc", structs.ContextDesc).log)

    def test_plugin_paths(self):
        def read_paths(desc, out):
            paths = ctypes.cast(desc.plugin_paths, ctypes.POINTER(ctypes.c_char_p))
            self.assertEqual(
                [paths[i] for i in range(desc.plugin_path_count)], [b"/a/b", "/é".encode()]
            )
            out.value = 1

        with mock.patch.object(_library.native, "defrec_context_create", read_paths):
            Context(["/a/b", "/é"])

    def test_plugins_and_devices(self):
        stub.answer("defrec_plugin_count", 2)
        stub.answer("defrec_device_count", 1)
        plugin = self.context.plugins[1]
        device = self.context.devices[0]
        self.assertEqual(
            (plugin.name, plugin.path, plugin.version, plugin.reason),
            ("plugin name", "plugin path", "plugin version", "plugin reason"),
        )
        self.assertEqual(
            (plugin.verdict, device.id, device.name, device.driver),
            (Status.OK, "device id", "device name", "device driver"),
        )
        c = self.c
        self.assertEqual(
            [str(call) for call in self.log()],
            [f"defrec_plugin_count(context={c})"]
            + [
                f"defrec_plugin_get(context={c}, index={i}, out={WRITTEN['defrec_plugin_info']})"
                for i in range(2)
            ]
            + [f"defrec_device_count(context={c})"]
            + [f"defrec_device_get(context={c}, index=0, out={WRITTEN['defrec_device_info']})"],
        )

    def test_rig(self):
        M1, M2 = [[501, 0, 51], [0, 502, 52], [0, 0, 1]], [[601, 0, 61], [0, 602, 62], [0, 0, 1]]
        R, T = [[1, 2, 3], [4, 5, 6], [7, 8, 9]], [[-4.5], [0.25], [0.125]]
        with Rig(self.context, 640, 480, M1, [0.1, 0.2, 0.3, 0.4, 0.5], M2, None, R, T) as rig:
            self.assertEqual(
                rig.rectify_pixels([(1.5, 2.5), (3.5, 4.5)]).tolist(), [[1, 2], [3, 4]]
            )
            self.assertEqual(rig.distort_pixels([(5.5, 6.5)]).tolist(), [[1, 2]])
            self.assertEqual(rig.raw_size, (640, 480))
            r = hex(rig._native)
        created, got, *rest = self.log()
        desc = created.struct("desc", structs.RigDesc)
        self.assertEqual(created.arguments["context"], self.c)
        self.assertEqual((desc.width, desc.height, desc.flags), (640, 480, 0))
        self.assertEqual(
            (desc.left.fx, desc.left.fy, desc.left.cx, desc.left.cy), (501, 502, 51, 52)
        )
        self.assertEqual(
            (desc.right.fx, desc.right.fy, desc.right.cx, desc.right.cy), (601, 602, 61, 62)
        )
        self.assertEqual(list(desc.left.distortion), [0.1, 0.2, 0.3, 0.4, 0.5] + [0] * 9)
        self.assertEqual((desc.left.distortion_count, desc.right.distortion_count), (5, 0))
        self.assertEqual(list(desc.rotation), [1, 2, 3, 4, 5, 6, 7, 8, 9])
        self.assertEqual(list(desc.translation), [-4.5, 0.25, 0.125])
        self.assertEqual(str(got), f"defrec_rig_get(rig={r}, out={WRITTEN['defrec_rig_info']})")
        self.assertEqual(
            [str(call) for call in rest],
            [
                (
                    f"defrec_rig_rectify_pixels(rig={r}, raw_uv=[1.5, 2.5, 3.5, 4.5], count=2,"
                    " rectified_uv=written)"
                ),
                (
                    f"defrec_rig_distort_pixels(rig={r}, rectified_uv=[5.5, 6.5], count=1,"
                    " raw_uv=written)"
                ),
                f"defrec_rig_destroy(rig={r})",
            ],
        )

    def test_rectified_rig(self):
        make_rig(self.context).close()
        desc = self.log()[0].struct("desc", structs.RigDesc)
        self.assertEqual(bytes(desc.left), bytes(desc.right))
        self.assertEqual(
            (desc.left.fx, desc.left.fy, desc.left.cx, desc.left.cy), (500.5, 501.5, 50.25, 40.25)
        )
        self.assertEqual(
            (list(desc.rotation), list(desc.translation)),
            ([1, 0, 0, 0, 1, 0, 0, 0, 1], [-4.5, 0, 0]),
        )

    def test_stage(self):
        with Stage(
            self.context, StereoParams(width=640, height=480, min_disparity=-3), "cuda:1"
        ) as stage:
            stage.prepare_buffers([bytes(5), None])
            output = bytearray(9)
            stage.run_buffers([bytes(6), None, bytes(7)], [output, None])
            s = hex(stage._native)
            self.assertEqual(stage.kind, StageKind.STEREO)
        created, *rest = self.log()
        self.assertEqual(
            (
                created.arguments["context"],
                created.arguments["device_id"],
                created.arguments["stage"],
            ),
            (self.c, '"cuda:1"', "1"),
        )
        params = created.struct("params", structs.StereoParams)
        self.assertEqual(
            (params.width, params.height, params.min_disparity, params.disparities),
            (640, 480, -3, 0),
        )
        self.assertEqual(
            [str(call) for call in rest],
            [
                f"defrec_stage_prepare(stage={s}, in=[5, NULL], in_count=2)",
                (
                    f"defrec_stage_run(stage={s}, in=[6, NULL, 7], in_count=3, out=[9, NULL],"
                    " out_count=2)"
                ),
                f"defrec_stage_destroy(stage={s})",
            ],
        )

    def test_every_stage(self):
        for number, (params, kind) in enumerate(KIND_OF_PARAMS.items()):
            Stage(self.context, params()).close()
            created = self.log()[0]
            self.assertEqual(
                (kind, created.arguments["stage"], created.arguments["device_id"]),
                (number, str(number), "NULL"),
            )
            self.assertEqual(created.struct("params", params), params())

    def test_tracker(self):
        fields = STRUCTS["defrec_tracker_desc"]["fields"]
        options = [
            each
            for each in fields
            if each["name"] not in ("struct_size", "flags", "device_id", "format")
        ]
        switches = {each["name"]: True for each in options if each["summary"].startswith("1: ")}
        numbers = {
            each["name"]: i + 1 for i, each in enumerate(options) if each["name"] not in switches
        }
        numbers.update(seed=(1 << 64) - 2, min_disparity=-5, min_depth_mm=6.5)
        rig = make_rig(self.context)
        self.log()
        tracker = Tracker(self.context, rig, "cpu", format=Format.BGRA8, **switches, **numbers)
        with tracker:
            handle = hex(tracker._native)
        created, destroyed = self.log()
        desc = created.struct("desc", structs.TrackerDesc)
        self.assertEqual({name: getattr(desc, name) for name in numbers}, numbers)
        self.assertEqual(
            {name: getattr(desc, name) for name in switches}, dict.fromkeys(switches, 1)
        )
        self.assertEqual((desc.format, desc.flags), (4, 0))
        self.assertEqual(
            (created.arguments["context"], created.arguments["rig"]), (self.c, hex(rig._native))
        )
        self.assertEqual(str(destroyed), f"defrec_tracker_destroy(tracker={handle})")

    def test_fallback(self):
        with make_rig(self.context) as rig:
            self.log()
            Tracker(self.context, rig, "cpu", fallback=True).close()
        desc = self.log()[0].struct("desc", structs.TrackerDesc)
        self.assertEqual(desc.flags, TRACKER_FALLBACK)

    def test_device_id(self):
        def read(context, rig, desc, out):
            self.assertEqual(desc.device_id, b"cuda:GPU-1a2b")
            out.value = 1

        rig = make_rig(self.context)
        with mock.patch.object(_library.native, "defrec_tracker_create", read):
            Tracker(self.context, rig, "cuda:GPU-1a2b").close()

    def test_scan(self):
        image = bytes(96 * 80)
        self.log()
        self.assertEqual(detect_scan(image, image, 96, 80, Format.GRAY8), Scan.PROGRESSIVE)
        (call,) = self.log()
        earlier, later = (call.struct(name, structs.Image) for name in ("earlier", "later"))
        self.assertEqual(bytes(earlier), bytes(later))
        self.assertEqual((earlier.format, earlier.width, earlier.height), (Format.GRAY8, 96, 80))
        self.assertEqual((earlier.stride, call.arguments["scan"]), (96, "written"))
        with self.assertRaises(ValueError):
            detect_scan(image, image[1:], 96, 80, Format.GRAY8)

    def test_job(self):
        image = bytes(96 * 80 * 3)
        tracker = Tracker(self.context, make_rig(self.context))
        self.log()
        with tracker.submit(
            image,
            image,
            -(1 << 63) + 5,
            capture_template=True,
            deadline_ns=1 << 63,
            field=Field.BOTTOM,
        ) as job:
            j = hex(job._native)
            self.assertTrue(job.wait())
            self.assertTrue(job.wait(1.5))
            stub.answer("defrec_job_wait", Status.TIMEOUT)
            self.assertFalse(job.wait(0))
            stub.answer("defrec_job_wait", Status.OK)
            self.assertEqual(len(job.result().vertices), 0)
            moved = job.warp_points([(1.5, 2.5, 3.5), (4.5, 5.5, 6.5)])
            errors = job.point_covariances([(1.5, 2.5, 3.5), (4.5, 5.5, 6.5)])
            lifted = job.lift_points([(1.5, 2.5)])
            with job.template() as template:
                s = hex(template._native)
        self.assertEqual((lifted.xyz.tolist(), lifted.found.tolist()), ([[1, 2, 3]], [1]))
        self.assertEqual(
            (moved.xyz.tolist(), moved.status.tolist(), moved.expected_error_mm.tolist()),
            ([[1, 2, 3], [4, 5, 6]], [1, 2], [1, 2]),
        )
        self.assertEqual(
            (errors.covariance.tolist(), errors.evidence.tolist()),
            ([[1, 2, 3, 4, 5, 6], [7, 8, 9, 10, 11, 12]], [1, 2]),
        )
        submitted, *rest = self.log()
        frame = submitted.struct("frame", structs.Frame)
        self.assertEqual(submitted.arguments["tracker"], hex(tracker._native))
        self.assertEqual(
            (frame.timestamp_ns, frame.flags, frame.ignore, frame.samples, frame.deadline_ns),
            (-(1 << 63) + 5, 1, None, None, 1 << 63),
        )
        self.assertEqual(frame.field, Field.BOTTOM)
        a_slice = f"defrec_job_wait(job={j}, timeout_ns=100000000)"
        self.assertEqual(
            [str(call) for call in rest],
            [
                a_slice,
                f"defrec_job_wait(job={j}, timeout_ns=100000000)",
                f"defrec_job_wait(job={j}, timeout_ns=0)",
                a_slice,
                f"defrec_job_result(job={j}, out={WRITTEN['defrec_result']})",
                a_slice,
                (
                    f"defrec_job_warp_points(job={j}, template_xyz=[1.5, 2.5, 3.5, 4.5, 5.5, 6.5],"
                    " count=2, xyz=written, status=written, expected_error_mm=written)"
                ),
                a_slice,
                (
                    f"defrec_job_point_covariances(job={j}, template_xyz=[1.5, 2.5, 3.5, 4.5, 5.5,"
                    " 6.5], count=2, covariance=written, evidence=written)"
                ),
                a_slice,
                (
                    f"defrec_job_lift_points(job={j}, uv=[1.5, 2.5], count=1, xyz=written,"
                    " found=written)"
                ),
                a_slice,
                f"defrec_job_get_template(job={j}, out={s})",
                f"defrec_template_release(surface={s})",
                f"defrec_job_release(job={j})",
            ],
        )

    def test_ctrl_c_ends_a_wait_for_a_device_that_hangs(self):
        """Row 121."""
        tracker = Tracker(self.context, make_rig(self.context))
        image = bytes(96 * 80 * 3)
        job = tracker.submit(image, image, 0)
        stub.answer("defrec_job_wait", Status.TIMEOUT)
        waits = []
        wait_natively = _library.native.defrec_job_wait

        def wait(handle, timeout_ns):
            waits.append(timeout_ns)
            if len(waits) == 3:
                signal.raise_signal(signal.SIGINT)
            return wait_natively(handle, timeout_ns)

        with mock.patch.object(_library.native, "defrec_job_wait", wait):
            with self.assertRaises(KeyboardInterrupt):
                job.wait()
        self.assertEqual(waits, [100000000] * 3)
        self.assertFalse(job.wait(0.01))
        stub.answer("defrec_job_wait", Status.OK)
        job.close()

    def test_every_field_of_a_result_keeps_its_name(self):
        counted_by = {
            field["name"]: field["counted_by"]
            for field in STRUCTS["defrec_result"]["fields"]
            if "counted_by" in field
        }
        counts = {
            count: number for number, count in enumerate(dict.fromkeys(counted_by.values()), 2)
        }
        lengths = {"rigid_motion": 3, **{name: counts[count] for name, count in counted_by.items()}}
        given = structs.ResultStruct(
            **{name: number for name, number in counts.items() if name != "pixels"}
        )
        numbers, memory = {}, []
        for number, field in enumerate(dataclasses.fields(Result), 1):
            numbers[field.name] = number
            if field.name == "rigid_motion":
                given.rigid_motion[:] = [number] * 12
            elif field.name == "times":
                for time in given.times:
                    time.milliseconds = number
            elif field.name == "device_id":
                numbers[field.name] = "device"
                given.device_id = b"device"
            elif field.name in lengths:
                memory.append((ctypes.c_uint8 * 1024)(*[number] * 1024))
                setattr(given, field.name, ctypes.addressof(memory[-1]))
            else:
                setattr(given, field.name, number)
        result = copy_result(given, (7, counts["pixels"]))
        for name, number in numbers.items():
            value = getattr(result, name)
            if name not in lengths:
                self.assertEqual(value, number, name)
                continue
            self.assertEqual(len(value), lengths[name], name)
            if name == "times":
                self.assertEqual([time.milliseconds for time in value], [number] * lengths[name])
            elif name == "rigid_motion":
                self.assertEqual(value.tolist(), [[number] * 4] * 3)
            else:
                self.assertEqual(set(bytes(value)), {number}, name)

    def test_images_are_passed_where_they_lie(self):
        rows = (ctypes.c_uint8 * (80 * 128 * 3))()  # 96 of 128 pixels in each row
        view = memoryview(rows).cast("B").cast("B", (80, 128, 3))
        try:
            import numpy

            left = numpy.asarray(view)[:, 16:112]
            offset, stride = 48, 128 * 3
        except ImportError:  # a memoryview has no columns to leave out
            left = memoryview(rows).cast("B")[: 80 * 96 * 3]
            offset, stride = 0, 96 * 3
        right = bytes(96 * 80 * 3)
        ignore = bytearray(96 * 80)
        received = []

        def read(tracker, frame, out):
            for address in (frame.left, frame.right, frame.ignore):
                image = structs.Image.from_address(address)
                received.append(
                    (
                        image.pixels,
                        image.stride,
                        image.width,
                        image.height,
                        image.format,
                        image.memory,
                    )
                )
            out.value = 1

        tracker = Tracker(self.context, make_rig(self.context))
        with mock.patch.object(_library.native, "defrec_tracker_submit", read):
            tracker.submit(left, right, 1, ignore=ignore)
        right_address = ctypes.cast(right, ctypes.c_void_p).value
        ignore_address = ctypes.addressof(ctypes.c_char.from_buffer(ignore))
        self.assertEqual(
            received,
            [
                (ctypes.addressof(rows) + offset, stride, 96, 80, 2, None),
                (right_address, 96 * 3, 96, 80, 2, None),
                (ignore_address, 96, 96, 80, 1, None),
            ],
        )

    def test_memory(self):
        buffer = bytearray(96 * 80 * 3)
        tracker = Tracker(self.context, make_rig(self.context))
        self.log()
        with (
            tracker.import_memory(buffer) as memory,
            tracker.import_memory_at(0x7000, 0x123456789, MemoryKind.CUDA) as device_memory,
        ):
            handles = memory._native, device_memory._native
            frames = []

            def read(tracker, frame, out):
                left, right = structs.Image.from_address(frame.left), structs.Image.from_address(
                    frame.right
                )
                frames.append((left.memory, right.memory, left.pixels, left.stride, frame.samples))
                out.value = 1

            with mock.patch.object(_library.native, "defrec_tracker_submit", read):
                tracker.submit(memory, device_memory, 1, samples=device_memory)
        self.assertEqual(frames, [(*handles, None, 0, handles[1])])
        host, device, _, *released = self.log()
        desc = host.struct("desc", structs.MemoryDesc)
        self.assertEqual(
            (desc.kind, desc.address, desc.size),
            (1, ctypes.addressof(ctypes.c_char.from_buffer(buffer)), 96 * 80 * 3),
        )
        desc = device.struct("desc", structs.MemoryDesc)
        self.assertEqual((desc.kind, desc.address, desc.size), (2, 0x7000, 0x123456789))
        self.assertEqual(
            [str(call) for call in released],
            [f"defrec_memory_release(memory={hex(handle)})" for handle in reversed(handles)],
        )

    def test_cuda_array(self):
        class Rows:  # 80 rows of 96 pixels, 3 bytes each, 512 bytes from row to row
            __cuda_array_interface__ = {
                "data": (0x5000, False),
                "shape": (80, 96, 3),
                "strides": (512, 3, 1),
                "typestr": "|u1",
                "version": 3,
            }

        class Floats:
            __cuda_array_interface__ = {
                "data": (0x6000, False),
                "shape": (7, 8),
                "typestr": "<f4",
                "version": 2,
            }

        tracker = Tracker(self.context, make_rig(self.context))
        self.log()
        memories = tracker.import_memory(Rows()), tracker.import_memory(Floats())
        descs = [call.struct("desc", structs.MemoryDesc) for call in self.log()]
        self.assertEqual(
            [(desc.kind, desc.address, desc.size) for desc in descs],
            [(2, 0x5000, 79 * 512 + 288), (2, 0x6000, 224)],
        )
        del memories

    def test_template(self):
        tracker = Tracker(self.context, make_rig(self.context))
        t = hex(tracker._native)
        self.log()
        with (
            tracker.template() as template,
            Template.load(self.context, pathlib.Path("/in é")) as loaded,
        ):
            s, n = hex(template._native), hex(loaded._native)
            tracker.set_template(loaded)
            lifted = template.lift([(1.5, 2.5), (3.5, 4.5)])
            self.assertEqual(template.point_pieces([(1, 2, 3), (4, 5, 6)]).tolist(), [1, 2])
            template.save("/out")
            self.assertEqual(template.data().size, (0, 0))
        self.assertEqual(
            (lifted.xyz.tolist(), lifted.found.tolist()), ([[1, 2, 3], [4, 5, 6]], [True, True])
        )
        self.assertEqual(
            [str(call) for call in self.log()],
            [
                f"defrec_tracker_get_template(tracker={t}, out={s})",
                f'defrec_template_load(context={self.c}, path="/in é", out={n})',
                f"defrec_tracker_set_template(tracker={t}, surface={n})",
                (
                    f"defrec_template_lift(surface={s}, uv=[1.5, 2.5, 3.5, 4.5], count=2,"
                    " xyz=written, found=written)"
                ),
                (
                    f"defrec_template_point_pieces(surface={s}, template_xyz=[1, 2, 3, 4, 5, 6],"
                    " count=2, pieces=written)"
                ),
                f'defrec_template_save(surface={s}, path="/out")',
                f"defrec_template_get(surface={s}, out={WRITTEN['defrec_template_info']})",
                f"defrec_template_release(surface={n})",
                f"defrec_template_release(surface={s})",
            ],
        )

    def test_body(self):
        with Tracker(self.context, make_rig(self.context)).template() as template:
            s = hex(template._native)
            self.log()
            template.set_body()
            self.assertTrue(template.wait_body())
            self.assertTrue(template.wait_body(1.5))
            stub.answer("defrec_template_wait_body", Status.TIMEOUT)
            self.assertFalse(template.wait_body(0))
            template.set_body(poisson_ratio=0.25, cut_depth_mm=7.5)
        *lines, described, _ = self.log()
        self.assertEqual(
            [str(call) for call in lines],
            [
                f"defrec_template_set_body(surface={s}, desc=NULL)",
                f"defrec_template_wait_body(surface={s}, timeout_ns=100000000)",
                f"defrec_template_wait_body(surface={s}, timeout_ns=100000000)",
                f"defrec_template_wait_body(surface={s}, timeout_ns=0)",
            ],
        )
        desc = described.struct("desc", structs.BodyDesc)
        self.assertEqual((desc.flags, desc.poisson_ratio, desc.cut_depth_mm), (0, 0.25, 7.5))
        self.assertEqual(
            (desc.mesh.vertices, desc.mesh.vertex_count, desc.mesh.triangle_count), (None, 0, 0)
        )
        self.assertEqual((desc.regions, desc.region_count), (None, 0))

    def test_meshes_of_a_body(self):
        """What the description points to is there while the library reads it, whatever is collected
        meanwhile."""
        received = []

        def numbers(c_type, address, count):
            return [] if address is None else list((c_type * count).from_address(address))

        def read(surface, desc):
            gc.collect()
            bytearray(1 << 16)  # what was freed would be written over
            regions = [
                structs.BodyRegion.from_address(desc.regions + 40 * i)
                for i in range(desc.region_count)
            ]
            for mesh in [desc.mesh, *(region.mesh for region in regions)]:
                received.append(
                    (
                        numbers(ctypes.c_float, mesh.vertices, 3 * mesh.vertex_count),
                        numbers(ctypes.c_uint32, mesh.triangles, 3 * mesh.triangle_count),
                    )
                )
            received.append([(region.stiffness, region.flags) for region in regions])

        with Tracker(self.context, make_rig(self.context)).template() as template:
            with mock.patch.object(_library.native, "defrec_template_set_body", read):
                template.set_body(
                    Mesh([(1, 2, 3), (4, 5, 6)], [(0, 1, (1 << 32) - 1)]),
                    [
                        BodyRegion(([(7, 8, 9)], []), held=True),
                        BodyRegion(([], [(2, 1, 0)]), stiffness=2.5),
                    ],
                )
        self.assertEqual(ctypes.sizeof(structs.BodyRegion), 40)
        self.assertEqual(
            received,
            [
                ([1, 2, 3, 4, 5, 6], [0, 1, (1 << 32) - 1]),
                ([7, 8, 9], []),
                ([], [2, 1, 0]),
                [(0, 1), (2.5, 0)],
            ],
        )

    @unittest.skipIf(numpy is None, "needs NumPy")
    def test_arrays_of_a_mesh_are_passed_where_they_lie(self):
        vertices, triangles = numpy.zeros((4, 3), numpy.float32), numpy.zeros((2, 3), numpy.uint32)
        received = []

        def read(surface, desc):
            received.append((desc.mesh.vertices, desc.mesh.triangles))

        with Tracker(self.context, make_rig(self.context)).template() as template:
            with mock.patch.object(_library.native, "defrec_template_set_body", read):
                template.set_body((vertices, triangles))
                template.set_body((vertices.astype(float)[:, ::-1], triangles.astype(numpy.int64)))
        self.assertEqual(received[0], (vertices.ctypes.data, triangles.ctypes.data))
        self.assertTrue(set(received[0]).isdisjoint(received[1]))

    def test_targets(self):
        image = bytes(96 * 80 * 3)
        tracker = Tracker(self.context, make_rig(self.context))
        stub.answer("defrec_targets_count", 2)
        with tracker.template() as template, tracker.submit(image, image, 1) as job:
            s, j = hex(template._native), hex(job._native)
            self.log()
            targets = Targets(template, [(1.5, 2.5, 3.5), (float("nan"), 5.5, float("-inf"))])
            template.close()  # targets do not need it
            t = hex(targets._native)
            self.assertEqual((len(targets), repr(targets)), (2, "<Targets, 2>"))
            moved = job.move_targets(targets)
            targets.close()
            self.assertEqual(repr(targets), "<Targets, 2, closed>")
        self.assertEqual(
            [part.tolist() for part in moved],
            [[[1, 2, 3], [4, 5, 6]], [1, 2], [1, 2], [[1, 2, 3, 4, 5, 6], [7, 8, 9, 10, 11, 12]]],
        )
        self.assertEqual(
            [str(call).replace("-nan", "nan") for call in self.log()][:-1],
            [
                (
                    f"defrec_targets_create(surface={s}, template_xyz=[1.5, 2.5, 3.5, nan, 5.5,"
                    f" -inf], count=2, out={t})"
                ),
                f"defrec_targets_count(targets={t})",
                f"defrec_template_release(surface={s})",
                f"defrec_job_wait(job={j}, timeout_ns=100000000)",
                (
                    f"defrec_job_move_targets(job={j}, targets={t}, count=2, xyz=written,"
                    " covariance=written, status=written, expected_error_mm=written)"
                ),
                f"defrec_targets_destroy(targets={t})",
            ],
        )

    def test_fixed_frame(self):
        image = bytes(96 * 80 * 3)
        tracker = Tracker(self.context, make_rig(self.context))
        points, errors = [(1.5, 2.5, 3.5), (4, 5, 6)], [(1, 0, 0, 2, 0, 3), (4, 0, 0, 5, 0, 6)]
        pose = [[float(i == k) for k in range(6)] for i in range(6)]
        with tracker.submit(image, image, 1) as job:
            j = hex(job._native)
            self.log()
            moved = job.to_fixed_frame(points, errors, pose)
            job.to_fixed_frame(points)
            self.assertEqual(len(job.to_fixed_frame([]).xyz), 0)
            for wrong, what in (
                ((points, errors[:1]), "covariance has 1 rows, 2 expected"),
                ((points, None, pose[:5]), "pose_covariance has 5 rows, 6 expected"),
                ((points, None, errors[0]), "pose_covariance"),
            ):
                with self.assertRaisesRegex((TypeError, ValueError), what):
                    job.to_fixed_frame(*wrong)
            lines = [str(call) for call in self.log()]
        self.assertEqual(moved.xyz.tolist(), [[1, 2, 3], [4, 5, 6]])
        self.assertEqual(moved.covariance.tolist(), [[1, 2, 3, 4, 5, 6], [7, 8, 9, 10, 11, 12]])
        identity = ", ".join(str(int(i % 7 == 0)) for i in range(36))
        self.assertEqual(
            lines[:2],
            [
                (
                    f"defrec_job_to_fixed_frame(job={j}, pose_covariance=[{identity}], count=2,"
                    " camera_xyz=[1.5, 2.5, 3.5, 4, 5, 6], camera_covariance=[1, 0, 0, 2, 0, 3,"
                    " 4, 0, 0, 5, 0, 6], xyz=written, covariance=written)"
                ),
                (
                    f"defrec_job_to_fixed_frame(job={j}, pose_covariance=NULL, count=2,"
                    " camera_xyz=[1.5, 2.5, 3.5, 4, 5, 6], camera_covariance=NULL, xyz=written,"
                    " covariance=written)"
                ),
            ],
        )

    def test_plans(self):
        image = bytes(96 * 80 * 3)
        places = [(0, 0, 0), (9, 0, 0), (0, 9, 0)]
        tracker = Tracker(self.context, make_rig(self.context))
        received = []
        create = _library.native.defrec_plan_create

        def read(surface, registration, desc, out):
            gc.collect()
            bytearray(1 << 16)  # what was freed would be written over
            part = structs.PlanPart.from_address(desc.parts)
            received.append((part.name, part.first_triangle, part.triangle_count, desc.flags))
            received.append(list((ctypes.c_float * 9).from_address(desc.vertices)))
            received.append(list((ctypes.c_uint32 * 3).from_address(desc.triangles)))
            received.append(list((ctypes.c_double * 3).from_address(desc.targets)))
            received.append((desc.vertex_count, desc.triangle_count, desc.target_count))
            received.append(ctypes.c_char_p.from_address(desc.target_names).value)
            create(surface, registration, desc, out)

        def describe(handle, info):
            info.point_count = 2

        with tracker.template() as template, tracker.submit(image, image, 1) as job:
            found = Registration.from_pairs(places, places)
            with mock.patch.object(_library.native, "defrec_plan_create", read), mock.patch.object(
                _library.native, "defrec_plan_get", describe
            ):
                plan = Plan(
                    template,
                    found,
                    (places, [(0, 1, 2)]),
                    parts=[PlanPart("tumour \u00e9", 0, 1)],
                    targets=[(1.5, 2.5, 3.5)],
                    target_names=["tumour centre \u00e9"],
                    looked_at=True,
                )
                loaded = Plan.load(template, "/x")
            s, j, f = hex(template._native), hex(job._native), hex(found._native)
            p, q = hex(plan._native), hex(loaded._native)
            found.close()  # plans do not need it
            registered = Registration.from_pairs(places, places)
            self.assertEqual((len(plan), repr(plan)), (2, "<Plan, 2>"))
            plan.save("/y")
            moved = job.move_plan(plan)
            self.assertEqual(plan.data().parts, [])
            for bad in (None, template):
                with self.assertRaisesRegex(TypeError, "plan"):
                    job.move_plan(bad)
                with self.assertRaisesRegex(TypeError, "registration"):
                    Plan(template, bad)
            with self.assertRaisesRegex(TypeError, "template"):
                Plan.load(None, "/x")
            with self.assertRaisesRegex(ValueError, "2 names, there are 1 targets"):
                Plan(template, registered, targets=places[:1], target_names=["a", "b"])
            registered.close()
            plan.close()
            loaded.close()
        self.assertEqual(
            received,
            [
                ("tumour \u00e9".encode(), 0, 1, 1),
                [0, 0, 0, 9, 0, 0, 0, 9, 0],
                [0, 1, 2],
                [1.5, 2.5, 3.5],
                (3, 1, 1),
                "tumour centre \u00e9".encode(),
            ],
        )
        self.assertEqual(moved.xyz.tolist(), [[1, 2, 3], [4, 5, 6]])
        self.assertEqual(moved.expected_error_mm.tolist(), [1, 2])
        lines = [str(call) for call in self.log()]
        self.assertTrue(
            any(
                line.startswith(f"defrec_plan_create(surface={s}, registration={f}")
                for line in lines
            )
        )
        for line in (
            f'defrec_plan_load(surface={s}, path="/x", out={q})',
            f'defrec_plan_save(plan={p}, path="/y")',
            (
                f"defrec_job_move_plan(job={j}, plan={p}, count=2, xyz=written,"
                " covariance=written, status=written, expected_error_mm=written)"
            ),
            f"defrec_plan_destroy(plan={p})",
            f"defrec_plan_destroy(plan={q})",
        ):
            self.assertIn(line, lines)

    def test_motions_that_are_known(self):
        image = bytes(96 * 80 * 3)
        tracker = Tracker(self.context, make_rig(self.context))
        held = [(1, 2, 3, 4), (5, 6, 7, 8), (9, 10, 11, 12)]
        pose = [(1.5, 2.5, 3.5, 4.5), (5.5, 6.5, 7.5, 8.5), (9.5, 10.5, 11.5, 12.5)]
        self.log()
        for given, flags in (({}, 0), ({"held_motion": held}, 2), ({"camera_pose": pose}, 4)):
            tracker.submit(image, image, 1, **given).close()
            frame = self.log()[0].struct("frame", structs.Frame)
            self.assertEqual(frame.flags, flags)
            for name in ("held_motion", "camera_pose"):
                expected = [number for row in given.get(name, [[0] * 12]) for number in row]
                self.assertEqual(list(getattr(frame, name)), expected)
        tracker.submit(
            image, image, 1, held_motion=held, camera_pose=pose, capture_template=True
        ).close()
        self.assertEqual(self.log()[0].struct("frame", structs.Frame).flags, 7)

    def test_failure(self):
        stub.answer("defrec_template_load", Status.ERROR_BUSY, "taken")
        with self.assertRaisesRegex(BusyError, "taken"):
            Template.load(self.context, "/x")
        self.log()

    def test_every_function_takes_what_the_header_says(self):
        for function in CONTRACT["functions"]:
            arguments = [argument(i, each) for i, each in enumerate(function["parameters"])]
            getattr(_library.native, function["name"])(*(value for value, _ in arguments))
            call = stub.calls()[0]
            self.assertEqual(call.function, function["name"])
            for each, (_, expected) in zip(function["parameters"], arguments):
                self.assertRegex(call.arguments[each["name"]], expected, call)

    def test_every_function_is_offered(self):
        package = pathlib.Path(_library.__file__).parent
        code = "".join(path.read_text() for path in package.glob("*.py"))
        for function in CONTRACT["functions"]:
            self.assertRegex(code, rf"\bnative\.{function['name']}\b")


if __name__ == "__main__":
    unittest.main()
