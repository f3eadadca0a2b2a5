"""A sequence in one call: track(left, right, calibration) gives frame after frame."""
from __future__ import annotations

import base64
import collections
import html
import importlib
import inspect
import io
import math
import warnings
from dataclasses import dataclass, field
from typing import (
    Any,
    Deque,
    Generator,
    Iterable,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
)

from ._arrays import ArrayLike, BufferLike, ByteArray, FloatArray, numpy
from .calibration import CalibrationLike, rig_of
from .context import Context
from .enums import BodyMode, Format, LogLevel, PointStatus, Reason, State, Status
from .errors import DefrecWarning, Error
from .images import Images, Pairs, pairs_of, pillow
from .points import WarpedPoints
from .result import Result
from .rig import Rig
from .template import Template
from .tracker import Job, Tracker

_OPTIONS = inspect.signature(Tracker).parameters
_COLOURS = {PointStatus.OBSERVED: (64, 220, 96), PointStatus.EXTRAPOLATED: (255, 176, 32)}


class FollowedPoints(NamedTuple):
    """The points that are followed, in one frame."""

    uv: FloatArray
    """(n, 2) float64, px of the left image as it was given; NaN where there is no answer."""
    xyz: FloatArray
    """(n, 3) float64, mm, rectified left camera."""
    status: ByteArray
    """(n,) uint8, PointStatus; UNKNOWN where the template has no surface under the pixel."""
    expected_error_mm: FloatArray
    """(n,) float64, root mean square of the 3D error to be expected."""
    covariance: FloatArray
    """(n, 6) float64, xx, xy, xz, yy, yz, zz of the error, mm^2."""
    evidence: ByteArray
    """(n,) uint8, Evidence: what was observed there."""


class RigEstimate(NamedTuple):
    """How far the cameras are from their calibration; see Result."""

    view_lag_frames: float
    vertical_offset_px: float
    roll_deg: float
    focal_ratio: float
    matches: int


@dataclass(frozen=True, repr=False)
class TrackedFrame:
    """What track() gives for a frame. It owns its arrays. In a notebook it shows itself."""

    index: int
    """In the sequence, from 0."""
    image: Any
    """The left image, as it was given or read."""
    format: Format
    result: Result
    """State, reasons, surface and everything else that the library says of the frame."""
    points: Optional[FollowedPoints]
    """None while there is no template."""
    _job: Job = field(compare=False)

    @property
    def state(self) -> State:
        """State of the tracker after this frame."""
        return self.result.state

    @property
    def reasons(self) -> List[str]:
        """Names of what is wrong, most frames: none."""
        return [reason.name or "" for reason in Reason if reason in self.result.reasons]

    @property
    def rig_estimate(self) -> Optional[RigEstimate]:
        """None where it was not measured."""
        r = self.result
        if r.rig_matches == 0:
            return None
        return RigEstimate(
            r.view_lag_frames, r.vertical_offset_px, r.roll_deg, r.focal_ratio, r.rig_matches
        )

    def warp_points(self, template_xyz: ArrayLike) -> WarpedPoints:
        """Moves (n, 3) points to this frame, mm, given in the template frame, such as those of a
        preoperative model (Job.warp_points). Possible until the next frame is taken.

        Raises Error, with Status.ERROR_STATE where there is no template yet, and with
        Status.ERROR_HANDLE once the next frame was taken.
        """
        if self._job.is_closed:
            raise Error(
                Status.ERROR_HANDLE,
                f"frame {self.index} was followed by another one: its points can be moved until the"
                " next frame is taken",
            )
        return self._job.warp_points(template_xyz)

    def counts(self) -> Tuple[int, int, int]:
        """How many points are tracked, extrapolated and lost."""
        statuses = [] if self.points is None else self.points.status.tolist()
        observed, extrapolated = (
            statuses.count(status) for status in (PointStatus.OBSERVED, PointStatus.EXTRAPOLATED)
        )
        return observed, extrapolated, len(statuses) - observed - extrapolated

    def median_expected_error_mm(self) -> float:
        """Median expected error of the points that are not lost; NaN without any."""
        if self.points is None:
            return math.nan
        known: List[float] = sorted(
            error
            for error, status in zip(
                self.points.expected_error_mm.tolist(), self.points.status.tolist()
            )
            if status != PointStatus.UNKNOWN
        )
        return known[len(known) // 2] if known else math.nan

    def __repr__(self) -> str:
        observed, extrapolated, lost = self.counts()
        reasons = f" ({', '.join(self.reasons)})" if self.reasons else ""
        return (
            f"<TrackedFrame {self.index}: {self.state.name}{reasons}, {observed} points tracked,"
            f" {extrapolated} extrapolated, {lost} lost, expected error"
            f" {self.median_expected_error_mm():.2f} mm>"
        )

    def picture(self) -> Any:
        """The left image with the points, as a Pillow image: tracked ones green, extrapolated ones
        orange. Raises ImportError without Pillow."""
        draws = pillow("PIL.ImageDraw")
        picture = _pillow_image(self.image, self.format)
        draw = draws.Draw(picture)
        radius = max(2, picture.width // 240)
        for (u, v), colour in self._drawn_points():
            draw.ellipse(
                (u - radius, v - radius, u + radius, v + radius),
                outline=colour,
                width=max(1, radius // 2),
            )
        return picture

    def plot(self, axes: Any = None) -> Any:
        """Draws the left image, and the points coloured by their expected error, with matplotlib;
        returns the axes. Raises ImportError without matplotlib."""
        if axes is None:
            axes = importlib.import_module("matplotlib.pyplot").subplots()[1]
        axes.imshow(_pillow_image(self.image, self.format))
        axes.set_title(repr(self)[1:-1].split(",")[0])
        axes.set_axis_off()
        if self.points is not None:
            for status, marker in ((PointStatus.OBSERVED, "o"), (PointStatus.EXTRAPOLATED, "x")):
                chosen = [i for i, each in enumerate(self.points.status.tolist()) if each == status]
                if not chosen:
                    continue
                uv, errors = self.points.uv.tolist(), self.points.expected_error_mm.tolist()
                drawn = axes.scatter(
                    [uv[i][0] for i in chosen],
                    [uv[i][1] for i in chosen],
                    c=[errors[i] for i in chosen],
                    vmin=0,
                    vmax=2,
                    marker=marker,
                    s=12,
                    label=status.name.lower(),
                )
                if status == PointStatus.OBSERVED:
                    axes.figure.colorbar(drawn, ax=axes, label="expected error, mm")
        return axes

    def _drawn_points(self) -> Iterator[Tuple[Tuple[float, float], Tuple[int, int, int]]]:
        if self.points is None:
            return
        for (u, v), status in zip(self.points.uv.tolist(), self.points.status.tolist()):
            if status in _COLOURS and math.isfinite(u) and math.isfinite(v):
                yield (u, v), _COLOURS[PointStatus(status)]

    def _repr_html_(self) -> str:
        observed, extrapolated, lost = self.counts()
        rows = [
            ("frame", str(self.index)),
            ("state", self.state.name.lower()),
            ("reasons", ", ".join(self.reasons).lower() or "none"),
            ("points", f"{observed} tracked, {extrapolated} extrapolated, {lost} lost"),
            ("expected error, median", f"{self.median_expected_error_mm():.2f} mm"),
            (
                "surface",
                (
                    f"{len(self.result.vertices)} vertices,"
                    f" {100 * self.result.observed_share:.0f} % observed"
                ),
            ),
        ]
        estimate = self.rig_estimate
        if estimate is not None:
            rows.append(
                (
                    "rig",
                    (
                        f"right view {estimate.vertical_offset_px:+.2f} px low, rolled"
                        f" {estimate.roll_deg:+.3f} degrees"
                    ),
                )
            )
        table = "".join(
            f"<tr><th>{name}</th><td>{html.escape(value)}</td></tr>" for name, value in rows
        )
        try:
            file = io.BytesIO()
            self.picture().save(file, "PNG")
        except ImportError:
            return f"<table>{table}</table>"
        data = base64.b64encode(file.getvalue()).decode()
        return (
            f'<table>{table}</table><img alt="left image with points"'
            f' src="data:image/png;base64,{data}">'
        )


class Tracking(Iterator[TrackedFrame]):
    """What track() returns: iterates over the frames. rig and tracker may be used meanwhile;
    close(), or with, frees them before the sequence has ended."""

    def __init__(
        self,
        pairs: Pairs,
        calibration: CalibrationLike,
        points: Optional[ArrayLike],
        timestamps_ns: Iterable[int],
        device_id: Optional[str],
        options: Any,
    ) -> None:
        self._images = pairs.images
        try:
            first = next(self._images)
        except StopIteration:
            raise ValueError("left and right have no images") from None
        self.width, self.height, found = _shape(first[0])
        if options.get("format") is None:
            options["format"] = pairs.colours if found == Format.BGR8 else found
        self._format = Format(options["format"])
        self._timestamps = iter(timestamps_ns)
        pixels = None if points is None else _inside(points, self.width, self.height)
        logged: Deque[str] = collections.deque()  # filled by threads of the library
        self._logged = logged
        self.context = Context(
            log=lambda _, source, text: logged.append(
                text if source == "sdk" else f"{source}: {text}"
            ),
            log_level=LogLevel.WARNING,
        )
        self.rig: Rig = rig_of(self.context, calibration, self.width, self.height)
        self._is_grid = points is None
        self._pixels = self.rig._rectify_pixels(
            "points", _grid(self.width, self.height) if pixels is None else pixels
        )
        self.tracker = Tracker(self.context, self.rig, device_id, **options)
        self._has_body = options.get("body", BodyMode.ON) == BodyMode.ON
        self._xyz: Any = None  # of the points, template frame; None: there is no template
        self._found: List[bool] = []
        self._pending: Deque[Any] = collections.deque()  # left images of frames that are computed
        self._count = 0
        self._frames = self._track(first)
        self._warn(4)  # of track(), as of __next__(), the caller's line

    def __iter__(self) -> "Tracking":
        return self

    def __next__(self) -> TrackedFrame:
        try:
            return next(self._frames)
        finally:
            self._warn()

    def __enter__(self) -> "Tracking":
        return self

    def __exit__(self, *ignored: Any) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Tracking of {self.width}x{self.height} images, {self._count} frames so far>"

    def close(self) -> None:
        """Ends the sequence, and frees tracker, rig and context."""
        self._frames.close()
        for handle in (self.tracker, self.rig, self.context):
            handle.close()

    def template(self) -> Template:
        """The present template. Raises Error before there is one."""
        return self.tracker.template()

    def _warn(self, stacklevel: int = 3) -> None:
        """What the library's threads have logged since, on the thread that iterates."""
        while self._logged:
            warnings.warn(self._logged.popleft(), DefrecWarning, stacklevel=stacklevel)

    def _submitted(self, first: Tuple[Any, Any]) -> Iterator[Tuple[BufferLike, BufferLike, int]]:
        pair: Optional[Tuple[Any, Any]] = first
        while pair is not None:
            timestamp = next(self._timestamps, None)
            if timestamp is None:
                raise ValueError("there are more images than timestamps_ns")
            self._pending.append(pair[0])
            yield pair[0], pair[1], timestamp
            pair = next(self._images, None)

    def _track(self, first: Tuple[Any, Any]) -> Generator[TrackedFrame, None, None]:
        for job in self.tracker.process(self._submitted(first)):
            result = job.result()
            frame = TrackedFrame(
                self._count,
                self._pending.popleft(),
                self._format,
                result,
                self._follow(job, result),
                job,
            )
            self._count += 1
            yield frame

    def _follow(self, job: Job, result: Result) -> Optional[FollowedPoints]:
        if len(result.vertices) == 0:
            self._xyz = None  # of a template that was given up
            return None
        if self._xyz is None:
            self._xyz = self._lift(job)
        moved, errors = job.warp_points(self._xyz), job.point_covariances(self._xyz)
        evidence = errors.evidence
        for i, found in enumerate(self._found):
            if not found:
                moved.status[i], evidence[i] = PointStatus.UNKNOWN, 0
        uv = self.rig.distort_pixels(self._project(moved.xyz.tolist()))
        return FollowedPoints(
            uv, moved.xyz, moved.status, moved.expected_error_mm, errors.covariance, evidence
        )

    def _lift(self, job: Job) -> Any:
        """Points that were given are of the first image, the grid is of the template's."""
        with job.template() as template:
            self._await_body(template)
            lifted = template.lift(self._pixels)
        self._found = lifted.found.tolist()
        if self._count > 0 and not self._is_grid:
            self._found = [False] * len(self._found)
            self._logged.append(
                f"the template is of image {self._count}: the points, which are of the first one,"
                " are lost"
            )
        return lifted.xyz

    def _await_body(self, template: Template) -> None:
        """What is told of points then depends on the frames alone, as with `defrec track`."""
        if self._has_body:
            try:
                template.wait_body()
            except Error as error:
                if error.status != Status.ERROR_UNSUPPORTED:  # points move without it
                    raise

    def _project(self, xyz: Sequence[Sequence[float]]) -> List[Tuple[float, float]]:
        c = self.rig.camera
        return [
            (c.fx * x / z + c.cx, c.fy * y / z + c.cy) if z > 0 else (math.nan, math.nan)
            for x, y, z in xyz
        ]


def track(
    left: Images,
    right: Optional[Images],
    calibration: CalibrationLike,
    points: Optional[ArrayLike] = None,
    *,
    layout: Optional[str] = None,
    fps: Optional[float] = None,
    timestamps_ns: Optional[Iterable[int]] = None,
    device_id: Optional[str] = None,
    **options: Any,
) -> Tracking:
    """Tracks a sequence, and gives a TrackedFrame for each pair of images. The first with a surface
    waits for the elastic body beneath it (Template.wait_body), unless body is BodyMode.OFF.

    left, right: a video, a folder of images, files, or uint8 arrays, each (height, width) or
        (height, width, 3 or 4). Videos are read with OpenCV's Python package, image files with
        Pillow, as gray or RGB8. Arrays of 3 channels are BGR8 unless format says otherwise. Arrays
        may come from a camera; frames_in_flight=1 then keeps the tracker from waiting for the next
        one.
    layout: "side-by-side" (left view on the left) or "top-bottom" (left view on top) where each
        image of left holds both views; right is None then.
    calibration: a file of OpenCV or a mapping with M1 D1 M2 D2 R T (mm), a Calibration, or the
        Camera of rectified images.
    points: (n, 2) pixels of the first left image to follow; None: a grid of 16 x 9 in the image
        that gives the template. Where that is a later one than the first, points that were given
        are lost, with a warning. Pixels outside the image are refused.
    fps, timestamps_ns: times of the frames, by their rate or each by itself, ns. Default: the
        video's own rate, 30 for images.
    device_id, options: of Tracker.

    What the library logs as a warning or an error becomes a DefrecWarning. Raises ValueError and
    TypeError for images and arguments that do not fit together, OSError for files, and Error.
    """
    for name in options:
        if name not in _OPTIONS:
            raise TypeError(f"track() got an unexpected keyword argument {name!r}")
    pairs = pairs_of(left, right, layout)
    if timestamps_ns is None:
        if fps is None:
            fps = pairs.rate or 30.0
        if not 0.001 <= fps <= 10000:
            raise ValueError(f"fps is {fps}, 0.001 to 10000 expected")
        timestamps_ns = _times(fps)
    return Tracking(pairs, calibration, points, timestamps_ns, device_id, options)


def _times(fps: float) -> Iterator[int]:
    frame = 0
    while True:
        yield int(frame * 1e9 / fps)
        frame += 1


def _grid(width: int, height: int) -> List[Tuple[float, float]]:
    return [
        ((0.05 + 0.9 * column / 15) * (width - 1), (0.05 + 0.9 * row / 8) * (height - 1))
        for row in range(9)
        for column in range(16)
    ]


def _inside(points: Any, width: int, height: int) -> Any:
    """The pixels, all of which lie in an image of that size."""
    rows = points.tolist() if hasattr(points, "tolist") else points
    try:
        pixels = [(float(u), float(v)) for u, v in rows]
    except (TypeError, ValueError):
        return points  # what is wrong with them is said where they are used
    for i, (u, v) in enumerate(pixels):
        if not (-0.5 <= u <= width - 0.5 and -0.5 <= v <= height - 0.5):
            raise ValueError(
                f"points: point {i}, ({u:g}, {v:g}), lies outside the image of {width} x {height}"
            )
    return points


def _shape(image: Any) -> Tuple[int, int, Format]:
    """Width, height and format."""
    shape = getattr(image, "shape", None)
    formats = {1: Format.GRAY8, 3: Format.BGR8, 4: Format.BGRA8}
    channels = (
        1
        if shape is not None and len(shape) == 2
        else shape[2]
        if shape is not None and len(shape) == 3
        else 0
    )
    if channels not in formats:
        raise ValueError(
            f"an image has shape {shape}; (height, width) or (height, width, 3 or 4) expected"
        )
    assert shape is not None
    return shape[1], shape[0], formats[channels]


def _pillow_image(image: Any, format: Format) -> Any:
    width, height, _ = _shape(image)
    modes = {Format.GRAY8: ("L", "L"), Format.RGB8: ("RGB", "RGB"), Format.BGR8: ("RGB", "BGR")}
    mode, raw = modes.get(format, ("RGBA", "BGRA"))
    data = image.tobytes() if hasattr(image, "tobytes") else bytes(image)
    return pillow("PIL.Image").frombytes(mode, (width, height), data, "raw", raw).convert("RGB")
