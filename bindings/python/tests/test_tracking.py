"""defrec.track on a reference sequence: its points are those of `defrec track`; what a frame shows
of itself.

SEQUENCE and TRACKED, from the environment: what `defrec render` wrote and what `defrec track` made
of it.
"""
import csv
import math
import os
import pathlib
import re
import sys
import tempfile
import unittest
import unittest.mock
import warnings

from PIL import Image

import defrec
from defrec._arrays import numpy
from defrec.images import _view

SEQUENCE, TRACKED = (pathlib.Path(os.environ[name]) for name in ("SEQUENCE", "TRACKED"))
LEFT, RIGHT, CALIBRATION = (SEQUENCE / name for name in ("left", "right", "calibration.yaml"))
STATUS = {"tracked": defrec.PointStatus.OBSERVED, "extrapolated": defrec.PointStatus.EXTRAPOLATED}


def points():
    with open(SEQUENCE / "points.csv", newline="") as file:
        return [(float(row["u"]), float(row["v"])) for row in csv.DictReader(file)]


def start(**options):
    options = {"device_id": "cpu", **options}
    return defrec.track(LEFT, RIGHT, CALIBRATION, **options)


class RecordingAxes:
    """What plot() asks of matplotlib's axes."""

    def __init__(self):
        self.calls = []
        self.figure = self

    def __getattr__(self, name):
        return lambda *arguments, **named: self.calls.append((name, arguments, named))


class FolderAsVideo:
    """OpenCV's VideoCapture, of a file that names a folder of images."""

    CAP_PROP_FPS = 5

    def __init__(self, path):
        folder = pathlib.Path(pathlib.Path(path).read_text())
        self.images = iter(sorted(folder.iterdir()) if folder.is_dir() else [])
        self.isOpened = folder.is_dir
        self.is_released = False

    def get(self, property):
        return 25.0 if property == self.CAP_PROP_FPS else 0.0

    def read(self):
        path = next(self.images, None)
        if path is None:
            return False, None
        red, green, blue = Image.open(path).convert("RGB").split()
        image = Image.merge("RGB", (blue, green, red))
        shape = (image.height, image.width, 3)
        return True, memoryview(image.tobytes()).cast("B", shape)

    def release(self):
        self.is_released = True


class Videos(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))

    def enterContext(self, manager):  # of Python 3.11
        self.addCleanup(manager.__exit__, None, None, None)
        return manager.__enter__()

    def file(self, name, content):
        path = self.folder / name
        path.write_text(str(content))
        return path

    def videos(self):
        return self.file("left.mp4", LEFT), self.file("right.mp4", RIGHT)

    def test_a_video_gives_what_its_images_give(self):
        opencv = unittest.mock.Mock(VideoCapture=FolderAsVideo, CAP_PROP_FPS=5)
        with unittest.mock.patch.dict(sys.modules, {"cv2": opencv}):
            frames = list(defrec.track(*self.videos(), CALIBRATION, points(), device_id="cpu"))
        expected = list(start(points=points()))
        self.assertEqual(len(frames), len(expected))
        self.assertEqual(frames[2].result.timestamp_ns, 80_000_000)  # at the video's own rate
        self.assertEqual(frames[0].format, defrec.Format.BGR8)
        for frame, image in zip(frames, expected):
            self.assertEqual(frame.points.status.tolist(), image.points.status.tolist())
        self.assertEqual(frames[0].picture().tobytes(), expected[0].picture().tobytes())

    def copy_of(self, folder, numbers, first=0):
        copied = self.folder / f"{folder.name}_{len(list(self.folder.iterdir()))}"
        copied.mkdir()
        files = sorted(folder.iterdir())
        for number in numbers:
            (copied / f"{first + number:06}.png").symlink_to(files[number])
        return copied

    def test_folders_that_do_not_pair_up_are_refused(self):
        left = self.copy_of(LEFT, range(6))
        for numbers, said in (
            ((0, 1, 3, 4, 5), "000002.png would be paired with .*000003.png"),
            (range(5), "6 images in left and 5 in right"),
        ):
            with self.assertRaisesRegex(ValueError, said):
                defrec.track(left, self.copy_of(RIGHT, numbers), CALIBRATION, device_id="cpu")
        # Cameras that count from different starts.
        later = self.copy_of(RIGHT, range(6), 40)
        self.assertEqual(len(list(defrec.track(left, later, CALIBRATION, device_id="cpu"))), 6)
        fewer = self.copy_of(RIGHT, range(5), 40)
        with self.assertRaisesRegex(ValueError, "6 images in left and 5 in right"):
            defrec.track(left, fewer, CALIBRATION, device_id="cpu")

    def test_without_opencv_the_error_says_what_to_install(self):
        with unittest.mock.patch.dict(sys.modules, {"cv2": None}):
            with self.assertRaisesRegex(ImportError, "left.mp4: .*opencv-python"):
                defrec.track(*self.videos(), CALIBRATION)

    def test_what_is_no_video_is_refused(self):
        opencv = unittest.mock.Mock(VideoCapture=FolderAsVideo, CAP_PROP_FPS=5)
        with unittest.mock.patch.dict(sys.modules, {"cv2": opencv}):
            with self.assertRaisesRegex(OSError, "not a video that OpenCV can read.*notes.txt"):
                defrec.track(self.file("notes.txt", "none"), RIGHT, CALIBRATION)

    def test_images_that_hold_both_views_are_split(self):
        if numpy is None:
            with self.assertRaisesRegex(ImportError, "NumPy"):
                defrec.track(LEFT, None, CALIBRATION, layout="side-by-side")
            return
        views = [list(_view(folder).images)[:2] for folder in (LEFT, RIGHT)]
        options = {"device_id": "cpu"}
        tracked = defrec.track(*views, CALIBRATION, **options)
        expected = [frame.points.xyz.tolist() for frame in tracked]
        for layout, axis in (("side-by-side", 1), ("top-bottom", 0)):
            both = [numpy.concatenate(pair, axis=axis) for pair in zip(*views)]
            frames = defrec.track(both, None, CALIBRATION, layout=layout, **options)
            self.assertEqual([frame.points.xyz.tolist() for frame in frames], expected)
        odd = [numpy.zeros((64, 95), dtype=numpy.uint8)]
        with self.assertRaisesRegex(ValueError, "an even width expected"):
            defrec.track(odd, None, CALIBRATION, layout="side-by-side")

    def test_a_layout_and_a_right_view_are_not_both_given(self):
        with self.assertRaisesRegex(TypeError, "right was given beside a layout"):
            defrec.track(LEFT, RIGHT, CALIBRATION, layout="side-by-side")
        with self.assertRaisesRegex(TypeError, "right is None without a layout"):
            defrec.track(LEFT, None, CALIBRATION)
        with self.assertRaisesRegex(ValueError, "side-by-side or top-bottom expected"):
            defrec.track(LEFT, None, CALIBRATION, layout="over-under")

    def test_files_are_red_first_in_a_list_too(self):
        files = [sorted(folder.iterdir())[:1] for folder in (LEFT, RIGHT)]
        frame = next(defrec.track(*files, CALIBRATION, device_id="cpu"))
        self.assertEqual(frame.format, defrec.Format.RGB8)


class Track(unittest.TestCase):
    def test_points_equal_those_of_defrec_track(self):
        with open(TRACKED / "points.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        given, compared = points(), 0
        for frame in start(points=given):
            for i, row in enumerate(
                rows[frame.index * len(given) : (frame.index + 1) * len(given)]
            ):
                self.assertEqual(int(row["frame"]), frame.index)
                self.assertEqual(
                    frame.points.status[i], STATUS.get(row["status"], defrec.PointStatus.UNKNOWN)
                )
                if row["status"] == "lost":
                    continue
                self.assertEqual(
                    [f"{frame.points.xyz[i, k]:.4f}" for k in range(3)], [row[k] for k in "xyz"]
                )
                self.assertEqual(
                    f"{frame.points.expected_error_mm[i]:.4f}", row["expected_error_mm"]
                )
                self.assertAlmostEqual(frame.points.covariance[i, 0], float(row["xx"]), delta=1e-6)
                self.assertAlmostEqual(frame.points.uv[i, 0], float(row["u"]), delta=1e-3)
                self.assertAlmostEqual(frame.points.uv[i, 1], float(row["v"]), delta=1e-3)
                compared += 1
        self.assertGreater(compared, 1000)
        self.assertEqual(frame.index, 11)

    def test_a_grid_is_followed_by_default(self):
        with start() as tracking:
            frame = next(tracking)
            self.assertEqual(sum(frame.counts()), 144)
            self.assertGreater(frame.counts()[0], 72)
            self.assertAlmostEqual(frame.points.uv[0, 0], 0.05 * 319, delta=0.1)
            self.assertEqual(len(tracking.template().data().vertices), len(frame.result.vertices))
            self.assertIn("1 frames so far", repr(tracking))

    def test_a_frame_outlives_what_made_it(self):
        tracking = start()
        frame = next(tracking)
        before = frame.points.xyz.tolist()
        for _ in tracking:
            pass
        tracking.close()
        self.assertEqual(frame.points.xyz.tolist(), before)
        with self.assertRaises(defrec.Error):
            tracking.template()

    def test_arrays_of_another_order_of_colours_give_the_same(self):
        if numpy is None:
            self.skipTest("turning arrays round is NumPy's")
        expected = next(start())
        left, right = (
            [numpy.ascontiguousarray(image[:, :, ::-1]) for image in list(_view(folder).images)[:2]]
            for folder in (LEFT, RIGHT)
        )
        for calibration in (
            CALIBRATION,
            defrec.Calibration.load(CALIBRATION),
            vars(defrec.Calibration.load(CALIBRATION)),
        ):
            found = next(defrec.track(left, right, calibration, device_id="cpu"))
            self.assertEqual(found.format, defrec.Format.BGR8)
            self.assertEqual(found.points.xyz.tolist(), expected.points.xyz.tolist())
            self.assertEqual(found.picture().tobytes(), expected.picture().tobytes())

    def test_a_calibration_of_another_image_size_is_refused(self):
        calibration = vars(defrec.Calibration.load(CALIBRATION)).copy()
        calibration["image_width"] *= 2
        for given in (calibration, defrec.Calibration(**calibration)):
            with self.assertRaisesRegex(ValueError, "px but the frames are .* scaled silently"):
                defrec.track(LEFT, RIGHT, given, device_id="cpu")

    def test_matrices_may_have_the_names_of_opencvs_functions(self):
        text = CALIBRATION.read_text()
        for ours, theirs in (("M", "cameraMatrix"), ("D", "distCoeffs"), ("M", "K")):
            with tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder, "calibration.yaml")
                path.write_text(re.sub(rf"(?m)^{ours}([12]):", rf"{theirs}\1:", text))
                self.assertEqual(
                    defrec.Calibration.load(path), defrec.Calibration.load(CALIBRATION)
                )

    def test_gray_files_and_times_of_ones_own(self):
        gray = [Image.open(path).convert("L") for path in sorted(LEFT.iterdir())[:2]]
        shape = (gray[0].height, gray[0].width)
        images = [memoryview(image.tobytes()).cast("B", shape) for image in gray]
        frames = list(
            defrec.track(
                images,
                images,
                defrec.Calibration.load(CALIBRATION),
                device_id="cpu",
                timestamps_ns=[5, 70],
            )
        )
        self.assertEqual([frame.result.timestamp_ns for frame in frames], [5, 70])
        self.assertEqual(frames[0].format, defrec.Format.GRAY8)
        # Two views that are one show nothing at any depth.
        self.assertIsNone(frames[0].points)
        self.assertTrue(math.isnan(frames[0].median_expected_error_mm()))
        self.assertEqual(frames[0].counts(), (0, 0, 0))
        self.assertIn("0 points tracked", repr(frames[0]))

    def test_with_one_frame_in_flight_no_later_image_is_waited_for(self):
        taken = []

        def images(folder):
            for image in _view(folder).images:
                taken.append(folder)
                yield image

        for frame in defrec.track(
            images(LEFT), images(RIGHT), CALIBRATION, device_id="cpu", frames_in_flight=1
        ):
            self.assertEqual(len(taken), 2 * (frame.index + 1))

    def test_points_of_a_black_first_image_are_lost_and_a_grid_is_not(self):
        black = memoryview(bytes(3 * 320 * 240)).cast("B", (240, 320, 3))
        left, right = ([black, *list(_view(folder).images)[1:3]] for folder in (LEFT, RIGHT))
        options = {"device_id": "cpu", "format": defrec.Format.RGB8}
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            frames = list(defrec.track(left, right, CALIBRATION, points(), **options))
        self.assertIn(
            "the template is of image 1: the points, which are of the first one, are lost",
            [str(each.message) for each in caught if each.category is defrec.DefrecWarning],
        )
        self.assertIsNone(frames[0].points)
        for frame in frames[1:]:
            self.assertGreater(len(frame.result.vertices), 0)
            self.assertEqual(set(frame.points.status.tolist()), {defrec.PointStatus.UNKNOWN})
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            frames = list(defrec.track(left, right, CALIBRATION, **options))
        self.assertIn(defrec.PointStatus.OBSERVED, frames[1].points.status.tolist())

    def test_a_frame_moves_points_of_a_model_until_the_next_is_taken(self):
        with start(points=points()) as tracking:
            frame = next(tracking)
            model = [list(xyz) for xyz in frame.points.xyz.tolist()[:5]]
            model[0][2] += 10  # beneath the surface
            moved = frame.warp_points(model)
            self.assertEqual(len(moved.xyz), 5)
            self.assertNotEqual(moved.status[0], defrec.PointStatus.OBSERVED)
            # The first frame is the template's.
            for i in range(1, 5):
                for k in range(3):
                    self.assertAlmostEqual(moved.xyz[i, k], model[i][k], delta=0.3)
            next(tracking)
            with self.assertRaisesRegex(defrec.Error, "until the next frame is taken") as caught:
                frame.warp_points(model)
            self.assertIs(caught.exception.status, defrec.Status.ERROR_HANDLE)

    def test_what_the_library_warns_of_is_a_python_warning(self):
        # Distorted so that it folds within the image: a part of it is masked, which is logged.
        calibration = vars(defrec.Calibration.load(CALIBRATION)).copy()
        calibration["D1"] = calibration["D2"] = [-0.9, 0, 0, 0, 0]
        with self.assertWarnsRegex(defrec.DefrecWarning, "%") as caught:
            defrec.track(LEFT, RIGHT, calibration, device_id="cpu").close()
        self.assertEqual(caught.filename, __file__)

    def test_a_notebook_shows_a_frame(self):
        frame = next(start(points=points()))
        text = frame._repr_html_()
        self.assertIn("<th>state</th><td>tracking</td>", text)
        self.assertIn('src="data:image/png;base64,iVBOR', text)
        observed, extrapolated, lost = frame.counts()
        self.assertIn(f"{observed} tracked, {extrapolated} extrapolated, {lost} lost", text)
        self.assertIn("<TrackedFrame 0: TRACKING", repr(frame))
        # A point that is tracked is drawn in green where it is.
        i = frame.points.status.tolist().index(defrec.PointStatus.OBSERVED)
        u, v = (round(x) for x in frame.points.uv.tolist()[i])
        box = frame.picture().crop((u - 4, v - 4, u + 5, v + 5))
        self.assertIn((64, 220, 96), box.getdata())

    def test_plot_draws_into_axes(self):
        frame = next(start(points=points()))
        axes = RecordingAxes()
        self.assertIs(frame.plot(axes), axes)
        scattered = [call for call in axes.calls if call[0] == "scatter"]
        self.assertEqual(len(scattered[0][1][0]), frame.counts()[0])
        self.assertEqual(axes.calls[0][1][0].size, (320, 240))

    def test_the_rig_estimate_is_that_of_the_result(self):
        frames = list(start())
        measured = [frame for frame in frames if frame.rig_estimate is not None]
        self.assertTrue(measured)
        estimate = measured[-1].rig_estimate
        self.assertEqual(estimate.matches, measured[-1].result.rig_matches)
        self.assertLess(abs(estimate.vertical_offset_px), 0.5)
        self.assertIn("right view", measured[-1]._repr_html_())

    def test_without_pillow_the_error_says_what_to_install(self):
        with unittest.mock.patch.dict(sys.modules, {"PIL": None, "PIL.Image": None}):
            with self.assertRaisesRegex(ImportError, "pip install pillow"):
                start()

    def test_what_does_not_fit_is_refused(self):
        flat = memoryview(bytes(96 * 64)).cast("B", (64, 96))
        camera = defrec.Camera(fx=300, fy=300, cx=48, cy=32, baseline_mm=4)
        for message, arguments in {
            "no images": ([], [], camera),
            "no images in it": (SEQUENCE, RIGHT, camera),
            "right has 0 images": ([flat], [], camera),
            "has shape": ([memoryview(b"12")], [flat], camera),
            "calibration has no D1, M2": ([flat], [flat], {"M1": 1, "D2": 1, "R": 1, "T": 1}),
            "no matrix M1": ([flat], [flat], SEQUENCE / "points.csv"),
        }.items():
            with self.subTest(message), self.assertRaisesRegex(ValueError, message):
                defrec.track(*arguments, device_id="cpu")
        for images, said in (
            ("videos/%06d.png", "the folder itself instead of a pattern.*%06d.png"),
            ("surgery.mp4", "no such folder of images, and no such video.*surgery.mp4"),
        ):
            with self.assertRaisesRegex(FileNotFoundError, said):
                defrec.track(images, RIGHT, camera)
        with self.assertRaisesRegex(
            TypeError, r"^track\(\) got an unexpected keyword argument 'bakend'$"
        ):
            start(bakend="cpu")
        with self.assertRaisesRegex((TypeError, ValueError), "^points"):
            start(points=[400, 300])
        for outside in ((320, 10), (-1, 10), (10, 240), (math.nan, 10)):
            with self.assertRaisesRegex(ValueError, "point 1, .* outside the image of 320 x 240"):
                start(points=[(10, 10), outside])
        with self.assertRaisesRegex(ValueError, "fps is 0"):
            defrec.track(LEFT, RIGHT, camera, fps=0)
        with self.assertRaisesRegex(ValueError, "more images than timestamps_ns"):
            list(start(timestamps_ns=[0, 1]))
        more = defrec.track([flat], [flat, flat], camera, device_id="cpu")
        with self.assertRaisesRegex(ValueError, "right has more images"):
            list(more)


if __name__ == "__main__":
    unittest.main()
