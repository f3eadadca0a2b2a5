"""Trackers, and the jobs that frames become."""
from __future__ import annotations

import collections
import ctypes
import numbers
from contextlib import ExitStack, closing
from typing import Any, Callable, Deque, Dict, Iterable, Iterator, List, Optional, Tuple, Union

from . import structs
from ._arrays import (
    ArrayLike,
    BufferLike,
    Points,
    address_of,
    bytes_per_pixel,
    empty,
    flat,
    image,
)
from ._handle import Handle
from ._library import c_text, native, wait_in_slices
from ._tracker_options import OPTIONS, TrackerOptions
from .context import Context
from .enums import Field, Format, FrameFlag, MemoryKind
from .memory import Memory, memory_desc
from .points import FixedPoints, LiftedPoints, MovedTargets, PointCovariances, WarpedPoints
from .result import Result, copy_result
from .rig import Rig
from .plan import Plan
from .template import Targets, Template

# Its errors ("... got an unexpected keyword argument") name the class that was called.
TrackerOptions.__init__.__qualname__ = "Tracker.__init__"


class Job(Handle):
    """A frame that was submitted. Closing it gives its place in the queue back, and waits if it is
    being computed."""

    def __init__(
        self, create: Callable[[ctypes.c_void_p], Any], keep: Any, size: Tuple[int, int]
    ) -> None:
        super().__init__(create, native.defrec_job_release, keep)
        self._size = size

    def wait(self, timeout: Optional[float] = None) -> bool:
        """Waits until the frame is computed, at most timeout seconds; None: for ever. False: not
        yet. Ctrl-C ends it with KeyboardInterrupt.

        threads: any. Raises Error where the job failed.
        """
        return wait_in_slices(lambda ns: native.defrec_job_wait(self._native, ns), timeout)

    def result(self) -> Result:
        """Waits for the frame, and copies what it gave. threads: any. Raises Error where the job
        failed."""
        self.wait()
        found = structs.ResultStruct()
        with self._copying() as handle:
            native.defrec_job_result(handle, found)
            return copy_result(found, self._size)

    def template(self) -> Template:
        """Waits for the frame, and gives its template, which has as many vertices as its result:
        the tracker's present one may have grown since.

        threads: any. Raises Error, with Status.ERROR_STATE where there is no template yet.
        """
        self.wait()
        handle, keep = self._open()
        return Template(
            lambda out: native.defrec_job_get_template(handle, out),
            native.defrec_template_release,
            keep,
        )

    def lift_points(self, uv: ArrayLike) -> LiftedPoints:
        """Waits for the frame, and finds what lies under (n, 2) pixels of its rectified left image:
        points of the template frame, from where warp_points follows them.

        What is found BESIDE the surface moves with the tissue next to it, extrapolated, until the
        surface reaches it; to have it lie on the surface from then on, lift it again where
        warp_points has it in a later frame.

        threads: any. Raises Error, with Status.ERROR_STATE where there is no template yet.
        """
        given = Points("uv", uv, 2)
        self.wait()
        xyz, found = empty("d", (given.count, 3)), empty("B", (given.count,))
        native.defrec_job_lift_points(
            self._native, given.address, given.count, address_of(xyz), address_of(found)
        )
        return LiftedPoints(xyz, found)

    def warp_points(self, template_xyz: ArrayLike) -> WarpedPoints:
        """Waits for the frame, and moves (n, 3) points to it, mm, given in the template frame (a
        preoperative model). Points on the surface move with it; points beneath it are carried by
        the elastic body and never OBSERVED.

        threads: any. Raises Error, with Status.ERROR_STATE where there is no template yet.
        """
        given = Points("template_xyz", template_xyz, 3)
        self.wait()
        xyz, status, errors = (
            empty("d", (given.count, 3)),
            empty("B", (given.count,)),
            empty("d", (given.count,)),
        )
        native.defrec_job_warp_points(
            self._native,
            given.address,
            given.count,
            address_of(xyz),
            address_of(status),
            address_of(errors),
        )
        return WarpedPoints(xyz, status, errors)

    def point_covariances(self, template_xyz: ArrayLike) -> PointCovariances:
        """Waits for the frame, and gives the covariances of the errors of what warp_points gives
        for (n, 3) points, mm.

        threads: any. Raises Error, with Status.ERROR_STATE where there is no template yet.
        """
        given = Points("template_xyz", template_xyz, 3)
        self.wait()
        covariance, evidence = empty("d", (given.count, 6)), empty("B", (given.count,))
        native.defrec_job_point_covariances(
            self._native, given.address, given.count, address_of(covariance), address_of(evidence)
        )
        return PointCovariances(covariance, evidence)

    def move_targets(self, targets: Targets) -> MovedTargets:
        """Waits for the frame, and moves prepared targets to it, as warp_points and
        point_covariances do, faster.

        threads: any. Raises Error, with Status.ERROR_STATE where there is no template yet, and with
        Status.ERROR_ARGUMENT where the targets are of a template that this frame's did not become
        of.
        """
        if not isinstance(targets, Targets):
            raise TypeError(f"targets is a Targets, {targets!r} given")
        return self._move(native.defrec_job_move_targets, targets)

    def move_plan(self, plan: Plan) -> MovedTargets:
        """Waits for the frame, and moves the points of a plan to it, its vertices and then its
        targets, as move_targets does, with the error of the registration added to that of tracking.

        threads: any. Raises Error, with Status.ERROR_STATE where there is no template yet, and with
        Status.ERROR_ARGUMENT where the plan is of a template that this frame's did not become of.
        """
        if not isinstance(plan, Plan):
            raise TypeError(f"plan is a Plan, {plan!r} given")
        return self._move(native.defrec_job_move_plan, plan)

    def to_fixed_frame(
        self,
        camera_xyz: ArrayLike,
        covariance: Optional[ArrayLike] = None,
        pose_covariance: Optional[ArrayLike] = None,
    ) -> FixedPoints:
        """Carries (n, 3) points, mm, from the rectified camera of the job's frame, as its result
        and the functions above give them, to the fixed frame of the frame's camera_pose.

        covariance: (n, 6) of the points, as those functions give it; None: they are exact.
        pose_covariance: (6, 6), HandEye.pose_covariance gives it; None: the pose is exact.

        threads: any. Raises Error, with Status.ERROR_STATE where the frame was submitted without
        camera_pose.
        """
        given = Points("camera_xyz", camera_xyz, 3)
        errors = None if covariance is None else Points("covariance", covariance, 6)
        if errors is not None and errors.count != given.count:
            raise ValueError(f"covariance has {errors.count} rows, {given.count} expected")
        pose = None
        if pose_covariance is not None:
            pose = Points("pose_covariance", pose_covariance, 6)
            if pose.count != 6:
                raise ValueError(f"pose_covariance has {pose.count} rows, 6 expected")
        xyz, made = empty("d", (given.count, 3)), empty("d", (given.count, 6))
        native.defrec_job_to_fixed_frame(
            self._native,
            None if pose is None else pose.address,
            given.count,
            given.address,
            None if errors is None else errors.address,
            address_of(xyz),
            address_of(made),
        )
        return FixedPoints(xyz, made)

    def _move(self, function: Any, points: Union[Targets, Plan]) -> MovedTargets:
        points._native
        self.wait()
        count = len(points)
        xyz, status, errors = empty("d", (count, 3)), empty("B", (count,)), empty("d", (count,))
        covariance = empty("d", (count, 6))
        function(
            self._native,
            points._native,
            count,
            address_of(xyz),
            address_of(covariance),
            address_of(status),
            address_of(errors),
        )
        return MovedTargets(xyz, status, errors, covariance)


class Tracker(TrackerOptions):
    __doc__ = f"""Follows the surface that a rig observes.

    Opens the device and allocates everything that a frame needs. The library takes its default
    for what is 0, or None.

    device_id: of one of Context.devices; "cuda:*": that backend's device with the fewest trackers
        of the context; None: the first device with every stage.
    {OPTIONS}

    threads: any, but submit and set_template: one at a time (BusyError). Raises Error.
    """

    def _create(
        self, context: Context, rig: Rig, device_id: Optional[str], options: Dict[str, Any]
    ) -> None:
        if not isinstance(context, Context):
            raise TypeError(f"context is a Context, {context!r} given")
        if not isinstance(rig, Rig):
            raise TypeError(f"rig is a Rig, {rig!r} given")
        bytes_per_pixel(options["format"])  # refuses what is none
        desc = structs.TrackerDesc(**options)
        if device_id is not None:
            desc.device_id = c_text("device_id", device_id)
        handle, keep = context._open()
        Handle.__init__(
            self,
            lambda out: native.defrec_tracker_create(handle, rig._native, desc, out),
            native.defrec_tracker_destroy,
            keep,
        )
        self._raw_size = rig.raw_size
        self._size = rig.size
        self._format = Format(desc.format)
        self._frames_in_flight = desc.frames_in_flight or desc._defaults_["frames_in_flight"]

    def __repr__(self) -> str:
        (width, height), closed = self._raw_size, ", closed" if self.is_closed else ""
        return f"<Tracker of {width}x{height} {self._format.name} images{closed}>"

    def submit(
        self,
        left: Union[BufferLike, Memory],
        right: Union[BufferLike, Memory],
        timestamp_ns: int,
        *,
        ignore: Union[BufferLike, Memory, None] = None,
        capture_template: bool = False,
        samples: Optional[Memory] = None,
        deadline_ns: int = 0,
        held_motion: Optional[ArrayLike] = None,
        camera_pose: Optional[ArrayLike] = None,
        field: Field = Field.NONE,
        disparity: Optional[ArrayLike] = None,
        disparity_sigma: Union[float, ArrayLike, None] = None,
    ) -> Job:
        """Queues a frame and returns at once; jobs run in order.

        left, right: uint8 images of the rig's raw size in the tracker's format, (height, width,
            channels), gray (height, width); rows may have gaps between them. Nothing is converted;
            the library copies the pixels before this returns. Bytes without shape are taken as rows
            without gaps. Or a Memory, whose pixels stay as they are until the job is done.
        timestamp_ns: strictly growing, of any clock.
        ignore: (height, width) uint8 or bool; nonzero pixels of the left image are not tissue.
        capture_template: make this frame the template (the first usable frame is, unless one was
            set).
        samples: where the device leaves a SurfaceSample per template vertex.
        deadline_ns: from this call until the job is to be done; 0: no deadline. What is not
            expected to fit is left out: Reason.COARSE, Reason.UNCHECKED, in this order. A late job
            has Reason.OVERDUE.
        held_motion: (3, 4), a rotation and mm: rectified camera from template frame, of what holds
            the body (a bone, the base of the tissue). It carries the depth beneath the surface,
            instead of what is estimated from the surface.
        camera_pose: (3, 4), a rotation and mm: fixed frame (a navigation system's) from rectified
            camera, at the frame's time. Given with every frame from the template's on, it tells the
            motion of the tissue from that of the camera.
        field: the rows of both images that are of this frame's time; the others are not read but
            interpolated. An interlaced image is submitted twice, once for each field in the order
            of their times, half a frame period apart.
        disparity: (height, width) of the rectified left image, px, that a learned stereo network or
            a depth camera gave, in place of stage stereo; 0: none there. It is copied. Where it is
            not that of both images the frame has Reason.DISPARITY.
        disparity_sigma: with disparity, standard deviation of the error that a pixel shares with
            those around it, px: a number, or (height, width).

        threads: one. Raises BusyError with a full queue, Error for a timestamp that does not grow;
        TypeError and ValueError for images of another type or shape.
        """
        handle, tracker_keep = self._open()
        frame = structs.Frame(
            timestamp_ns=timestamp_ns,
            flags=FrameFlag.CAPTURE_TEMPLATE if capture_template else 0,
            deadline_ns=deadline_ns,
            field=field,
        )
        if held_motion is not None:
            frame.held_motion = _motion("held_motion", held_motion)
            frame.flags |= FrameFlag.HELD_MOTION
        if camera_pose is not None:
            frame.camera_pose = _motion("camera_pose", camera_pose)
            frame.flags |= FrameFlag.CAMERA_POSE
        keep: List[Any] = [tracker_keep]
        with ExitStack() as views:
            left_image = self._image("left", left, self._format, views, keep)
            right_image = self._image("right", right, self._format, views, keep)
            frame.left, frame.right = ctypes.addressof(left_image), ctypes.addressof(right_image)
            if ignore is not None:
                ignore_image = self._image("ignore", ignore, Format.GRAY8, views, keep)
                frame.ignore = ctypes.addressof(ignore_image)
            if samples is not None:
                if not isinstance(samples, Memory):
                    raise TypeError(f"samples is a Memory, {type(samples).__name__} given")
                frame.samples = _kept(samples, keep)
            if disparity is not None:
                given = self._disparity(disparity, disparity_sigma, keep)
                frame.disparity = ctypes.addressof(given)
            elif disparity_sigma is not None:
                raise ValueError("disparity_sigma is given without disparity")
            job = Job(
                lambda out: native.defrec_tracker_submit(handle, frame, out), keep, self._size
            )
        return job

    def _image(
        self, name: str, value: Any, format: Format, views: ExitStack, keep: List[Any]
    ) -> structs.Image:
        width, height = self._raw_size
        made = structs.Image(format=format, width=width, height=height)
        if isinstance(value, Memory):
            made.memory = _kept(value, keep)
        else:
            codes = "B?" if name == "ignore" else "B"
            view, made.stride = image(name, value, width, height, bytes_per_pixel(format), codes)
            views.enter_context(closing(view))
            made.pixels = view.address
        return made

    def _disparity(
        self, disparity: ArrayLike, sigma: Union[float, ArrayLike, None], keep: List[Any]
    ) -> structs.Disparity:
        width, height = self._size
        made = structs.Disparity(width=width, height=height)

        def rows(name: str, value: ArrayLike) -> int:
            points = Points(name, value, width, "f")
            if points.count != height:
                raise ValueError(f"{name} has {points.count} rows, {height} expected")
            keep.append(points)
            return points.address

        made.disparity = rows("disparity", disparity)
        if sigma is None:
            raise ValueError(
                "disparity is given without disparity_sigma, the error to expect of it"
            )
        if isinstance(sigma, numbers.Real):
            (made.sigma_px,) = flat("disparity_sigma", sigma, [1])
        else:
            made.sigma = rows("disparity_sigma", sigma)
        return made

    def track(
        self, left: BufferLike, right: BufferLike, timestamp_ns: int, **options: Any
    ) -> Result:
        """Submits a frame, waits for it, and returns what it gave: for those who have time.
        Arguments and errors: submit."""
        with self.submit(left, right, timestamp_ns, **options) as job:
            return job.result()

    def process(self, frames: Iterable[Tuple[BufferLike, BufferLike, int]]) -> Iterator[Job]:
        """Tracks a sequence: takes (left, right, timestamp_ns), gives each frame's job, done, in
        order, and closes it when the next is asked for. Meanwhile the frames behind it are
        computed, as many as frames_in_flight allows; with 1, each frame's job is given before the
        next frame is taken, as a camera needs it. Errors: submit and Job.wait."""
        pending: Deque[Job] = collections.deque()
        try:
            for left, right, timestamp_ns in frames:
                pending.append(self.submit(left, right, timestamp_ns))
                if len(pending) == self._frames_in_flight:
                    with pending.popleft() as job:
                        job.wait()
                        yield job
            while pending:
                with pending.popleft() as job:
                    job.wait()
                    yield job
        finally:
            for job in pending:
                job.close()

    def template(self) -> Template:
        """The present template. threads: any. Raises Error with Status.ERROR_STATE before there is
        one."""
        handle, keep = self._open()
        return Template(
            lambda out: native.defrec_tracker_get_template(handle, out),
            native.defrec_template_release,
            keep,
        )

    def set_template(self, template: Template) -> None:
        """Tracks this template from the next submitted frame on; the rig must have the same
        rectified camera and size. threads: one"""
        if not isinstance(template, Template):
            raise TypeError(f"template is a Template, {template!r} given")
        native.defrec_tracker_set_template(self._native, template._native)

    def import_memory(self, source: Any) -> Memory:
        """Lets this tracker's device work in an array's memory, without a copy.

        source: a writable array or buffer in the processor's memory, for devices that compute in
            it; or an array of a CUDA device, whatever has __cuda_array_interface__ (CuPy, PyTorch,
            Numba), for that device. It begins at its first element, which lies at a multiple of 16
            bytes. It is kept alive until the Memory and the jobs that were given it are closed.
        threads: any. Raises Error with Status.ERROR_UNSUPPORTED for what the device cannot reach.
        """
        return self._import(*memory_desc(source))

    def import_memory_at(
        self, address: int, size: int, kind: MemoryKind, owner: Any = None
    ) -> Memory:
        """Likewise of a bare address; size in bytes. owner, whatever it is, is kept alive as source
        would be."""
        return self._import(structs.MemoryDesc(kind=kind, address=address, size=size), owner)

    def _import(self, desc: structs.MemoryDesc, owner: Any) -> Memory:
        handle, keep = self._open()
        return Memory(
            lambda out: native.defrec_memory_import(handle, desc, out),
            native.defrec_memory_release,
            (keep, owner),
        )


def _motion(name: str, value: ArrayLike) -> Any:
    rows = Points(name, value, 4)
    if rows.count != 3:
        raise ValueError(f"{name} has the shape ({rows.count}, 4), (3, 4) expected")
    return (ctypes.c_double * 12).from_buffer_copy(ctypes.string_at(rows.address, 96))


def _kept(memory: Memory, keep: List[Any]) -> int:
    handle, owner = memory._open()
    keep.append(owner)
    return handle
