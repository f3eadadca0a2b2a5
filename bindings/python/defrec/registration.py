"""Where a preoperative model lies: Registration."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any, Iterable, List, NamedTuple, Optional, Sequence

from . import structs
from ._arrays import (
    ArrayLike,
    BoolArray,
    FloatArray,
    IndexArray,
    Points,
    address_of,
    copied,
    empty,
    flat,
)
from ._handle import Handle
from ._library import native, text
from .body import MeshLike
from .context import Context
from .enums import Deformation, FreeMotionKind, RegistrationFlag, Verdict
from .template import Template


@dataclass(frozen=True)
class FreeMotion:
    """A motion that the data of a registration or a hand-eye calibration do not tell from rest."""

    kind: FreeMotionKind
    axis: FloatArray
    """(3,), unit length, seen frame; of a hand-eye calibration the marker's frame."""
    point: FloatArray
    """(3,), mm, on the axis of a turn."""
    pitch_mm_per_rad: float
    """Shift along the axis for each rad of a turn."""
    expected_mm: float
    """Standard deviation at the typical distance of the data; 0: see expected_rad."""
    expected_rad: float
    """Standard deviation of a hand-eye calibration's turn, else 0."""
    text: str
    """For people."""


@dataclass(frozen=True)
class AlternativePose:
    """Another pose that fits about as well."""

    transform: FloatArray
    """(3, 4), seen frame from model frame, mm."""
    distance_mm: float
    """Root mean square by which it moves the points against the transform that was chosen."""
    rms_mm: float
    inlier_share: float


class RegisteredPoints(NamedTuple):
    """Points of a model, moved to the seen frame."""

    xyz: FloatArray
    """(n, 3) float64, mm, seen frame."""
    covariance: FloatArray
    """(n, 6) float64, xx, xy, xz, yy, yz, zz of the error, mm^2, seen frame."""
    expected_error_mm: FloatArray
    """(n,) float64, target registration error: the root of the covariance's trace."""


@dataclass(frozen=True)
class RegistrationResult:
    """Where a model lies; copies. Seen frame: that of what was seen, normally the template
    frame."""

    verdict: Verdict
    """Use nothing else but ACCEPTED without a person's look."""
    reason: str
    """The verdict's, one sentence for people."""
    transform: FloatArray
    """(3, 4) float64, seen frame from model frame: a rotation and mm; of a deformed model the rigid
    part of its motion."""
    covariance: FloatArray
    """(6, 6) float64, of the motion that the true transform has after this one: a turn about x, y,
    z of the seen frame and about its origin, rad, then a shift, mm."""
    rms_mm: float
    """Root mean square of the inliers' residuals."""
    robust_mm: float
    """Robust standard deviation of all residuals."""
    error_ratio: float
    """That of the residuals in units of their expected errors."""
    inlier_share: float
    """0 to 1 of what was compared."""
    correlated: float
    """So many neighbours share an error."""
    used: int
    """Points or pairs that were compared."""
    residuals: FloatArray
    """(n,) float32, mm, per point or pair given; NaN where it was not compared."""
    inliers: BoolArray
    """(n,) bool, per point or pair given: it fits."""
    triangles: IndexArray
    """(n, 3) uint32: those of the model that have an area, turned outwards."""
    dropped_triangles: int
    """Triangles of the model without an area."""
    open_edges: int
    """Edges of one triangle: the model is not closed."""
    odd_edges: int
    """Edges of more than two triangles, or of two that turn differently."""
    model_turned: bool
    """The model was inside out."""
    model_has_outside: bool
    """It tells its outside, so that its back is not taken for its front."""
    free_motions: List[FreeMotion]
    """Motions that the data leave open."""
    alternatives: List[AlternativePose]
    """Other poses that fit about as well, the best one first."""
    deformation: Deformation
    """Whether the model was deformed."""
    deformation_text: str
    """Why, one sentence for people; "" where none was asked for."""
    deformed_rms_mm: float
    """Root mean square displacement of the model's vertices against the transform; this and the
    next two 0 where the model was not deformed."""
    deformed_max_mm: float
    """The largest displacement."""
    largest_strain: float
    """The largest share by which the body is stretched or compressed along a direction."""
    rigid_rms_mm: float
    """rms_mm before the deformation, of the rigid motion."""
    rigid_robust_mm: float
    """Likewise robust_mm."""


class Registration(Handle):
    """Where a preoperative model lies. from_pairs(), from_surface() and from_template() make it.
    What fits nowhere, in several places or leaves a motion open raises nothing: result() says so.
    """

    @classmethod
    def from_pairs(
        cls,
        model_xyz: ArrayLike,
        seen_xyz: ArrayLike,
        *,
        model_covariance: Optional[ArrayLike] = None,
        seen_covariance: Optional[ArrayLike] = None,
        max_residual_mm: float = 0,
        max_error_mm: float = 0,
    ) -> "Registration":
        """Registers by pairs of places.

        model_xyz, seen_xyz: (n, 3), mm, model frame and seen frame; at least 3.
        model_covariance, seen_covariance: (n, 6), xx, xy, xz, yy, yz, zz of the errors, mm^2, of
            all pairs; None: 0, and where both are: not known, and alike.
        max_residual_mm: where the root mean square of the residuals is larger, the registration
            has failed; 0.001 to 100; default 5.
        max_error_mm: a motion with a larger standard deviation is undetermined; 0.001 to 100;
            default 2.

        threads: any. Raises Error for what is not finite, for covariances that are none, and for
        a number out of its range; TypeError and ValueError for arrays of another type or shape.
        """
        model, seen = Points("model_xyz", model_xyz, 3), Points("seen_xyz", seen_xyz, 3)
        _expect_count("seen_xyz", seen.count, model.count)
        desc = structs.RegistrationPairs(
            model_xyz=model.address,
            seen_xyz=seen.address,
            count=model.count,
            max_residual_mm=max_residual_mm,
            max_error_mm=max_error_mm,
        )
        keep: List[Any] = [model, seen]
        for name, given in (
            ("model_covariance", model_covariance),
            ("seen_covariance", seen_covariance),
        ):
            if given is not None:
                setattr(desc, name, _address(name, given, 6, "d", model.count, keep))
        return cls(
            lambda out: native.defrec_registration_from_pairs(desc, out),
            native.defrec_registration_destroy,
        )

    @classmethod
    def from_surface(
        cls,
        context: Context,
        model: MeshLike,
        seen_xyz: ArrayLike,
        *,
        normals: Optional[ArrayLike] = None,
        covariance: Optional[ArrayLike] = None,
        status: Optional[Iterable[int]] = None,
        **options: Any,
    ) -> "Registration":
        """Registers a model's surface to points that were seen of it.

        model: (vertices, triangles), (n, 3) mm and (n, 3) indices of vertices, counter-clockwise
            seen from outside, model frame.
        seen_xyz: (n, 3), mm, seen frame; at least 50 that count.
        normals: (n, 3), towards the camera; 0 0 0: not known.
        covariance: (n, 6), xx, xy, xz, yy, yz, zz of the errors, mm^2, as Result.vertex_covariance
            has them; None: see point_error_mm.
        status: (n,), PointStatus: those that are not OBSERVED are passed over; None: all count.

        Options, 0 means default:
        start: about where the model lies: (3, 4) or (4, 4), seen frame from model frame; None: the
            identity.
        viewer: where the camera stood, mm, seen frame; default its origin.
        camera: False: the points were not seen from viewer, so triangles that turn away from it
            are compared as well.
        max_turn_rad, max_shift_mm: how far the start may be off; default 30 degrees and 30 mm.
        starts: poses from which the search begins; 1 to 10000; default 20.
        point_error_mm: standard deviation of points without a covariance; default 0.5.
        model_error_mm: standard deviation of the model's surface; default 0.2.
        max_residual_mm, min_inlier_share: limits beyond which it has failed; default 3 and 0.4.
        max_error_mm: a motion with a larger standard deviation is undetermined; default 2.
        elastic: True: after the rigid motion the model, whose surface must be closed, is deformed
            as an elastic body, where what was seen says how.
        deformation_mm: how far its surface may be displaced against the rigid motion, root mean
            square; default 10.

        threads: any. Raises Error for a model that is none, for what is not finite and for a number
        out of its range; TypeError and ValueError for arrays of another type or shape.
        """
        keep: List[Any] = []
        desc = _desc(model, keep, **options)
        seen = Points("seen_xyz", seen_xyz, 3, "f")
        keep.append(seen)
        desc.seen_vertices, desc.seen_count = seen.address, seen.count
        if normals is not None:
            desc.seen_normals = _address("normals", normals, 3, "f", seen.count, keep)
        if covariance is not None:
            desc.seen_covariances = _address("covariance", covariance, 6, "f", seen.count, keep)
        if status is not None:
            values = _bytes("status", status)
            _expect_count("status", len(values), seen.count)
            keep.append(values)
            desc.seen_status = ctypes.addressof(values)
        handle, others = _open("context", context, Context)
        return cls(
            lambda out: native.defrec_registration_from_surface(handle, desc, out),
            native.defrec_registration_destroy,
            others,
        )

    @classmethod
    def from_template(
        cls, context: Context, template: Template, model: MeshLike, **options: Any
    ) -> "Registration":
        """Registers a model's surface to the vertices of a template whose depth was measured. model
        and options: as of from_surface(); the errors are those that stereo leaves, or
        point_error_mm where it is given. threads: any. Raises Error as from_surface()."""
        keep: List[Any] = []
        desc = _desc(model, keep, **options)
        handle, others = _open("context", context, Context)
        surface, _ = _open("template", template, Template)
        return cls(
            lambda out: native.defrec_registration_from_template(handle, surface, desc, out),
            native.defrec_registration_destroy,
            others,
        )

    def result(self) -> RegistrationResult:
        """Where the model lies. threads: any"""
        info = structs.RegistrationInfo()
        with self._copying() as handle:
            native.defrec_registration_get(handle, info)
            free = range(info.free_motion_count)
            return RegistrationResult(
                verdict=Verdict(info.verdict),
                reason=text(info.reason),
                transform=numbers(info.transform, (3, 4)),
                covariance=numbers(info.covariance, (6, 6)),
                rms_mm=info.rms_mm,
                robust_mm=info.robust_mm,
                error_ratio=info.error_ratio,
                inlier_share=info.inlier_share,
                correlated=info.correlated,
                used=info.used,
                residuals=copied(info.residuals, "f", (info.point_count,)),
                inliers=copied(info.inliers, "?", (info.point_count,)),
                triangles=copied(info.triangles, "I", (info.triangle_count, 3)),
                dropped_triangles=info.dropped_triangles,
                open_edges=info.open_edges,
                odd_edges=info.odd_edges,
                model_turned=info.model_turned != 0,
                model_has_outside=info.model_has_outside != 0,
                free_motions=[
                    free_motion(native.defrec_registration_get_free_motion, handle, i) for i in free
                ],
                alternatives=[_alternative(handle, i) for i in range(info.alternative_count)],
                deformation=Deformation(info.deformation),
                deformation_text=text(info.deformation_text),
                deformed_rms_mm=info.deformed_rms_mm,
                deformed_max_mm=info.deformed_max_mm,
                largest_strain=info.largest_strain,
                rigid_rms_mm=info.rigid_rms_mm,
                rigid_robust_mm=info.rigid_robust_mm,
            )

    def move_points(self, model_xyz: ArrayLike) -> RegisteredPoints:
        """Moves (n, 3) points of the model frame, mm, to the seen frame, with their target
        registration errors. A point that is not finite comes out as NaN. threads: any"""
        given = Points("model_xyz", model_xyz, 3)
        n = given.count
        xyz, covariance, error = empty("d", (n, 3)), empty("d", (n, 6)), empty("d", (n,))
        native.defrec_registration_move_points(
            self._native,
            given.address,
            n,
            address_of(xyz),
            address_of(covariance),
            address_of(error),
        )
        return RegisteredPoints(xyz, covariance, error)


def numbers(array: Any, shape: Sequence[int]) -> FloatArray:
    """A copy of the numbers of an array in a struct."""
    made: FloatArray = copied(ctypes.addressof(array), "d", shape)
    return made


def free_motion(get: Any, handle: int, index: int) -> FreeMotion:
    """What a function of the library tells of that free motion."""
    motion = structs.FreeMotionStruct()
    get(handle, index, motion)
    return FreeMotion(
        kind=FreeMotionKind(motion.kind),
        axis=numbers(motion.axis, (3,)),
        point=numbers(motion.point, (3,)),
        pitch_mm_per_rad=motion.pitch_mm_per_rad,
        expected_mm=motion.expected_mm,
        expected_rad=motion.expected_rad,
        text=text(motion.text),
    )


def _alternative(handle: int, index: int) -> AlternativePose:
    other = structs.RegistrationAlternative()
    native.defrec_registration_get_alternative(handle, index, other)
    return AlternativePose(
        numbers(other.transform, (3, 4)), other.distance_mm, other.rms_mm, other.inlier_share
    )


def _desc(
    model: MeshLike,
    keep: List[Any],
    *,
    start: Optional[ArrayLike] = None,
    viewer: ArrayLike = (0, 0, 0),
    camera: bool = True,
    elastic: bool = False,
    **options: float,
) -> structs.RegistrationDesc:
    """The description of a model and a search; what it points to lives as long as keep does."""
    try:
        vertices, triangles = model
    except (TypeError, ValueError):
        raise TypeError(
            f"model: vertices and triangles expected, {type(model).__name__} given"
        ) from None
    points = Points("model.vertices", vertices, 3, "f")
    corners = Points("model.triangles", triangles, 3, "I")
    keep += [points, corners]
    desc = structs.RegistrationDesc(
        flags=(0 if camera else RegistrationFlag.NO_CAMERA)
        | (RegistrationFlag.ELASTIC if elastic else 0),
        model_vertices=points.address,
        model_vertex_count=points.count,
        model_triangles=corners.address,
        model_triangle_count=corners.count,
    )
    for name, value in options.items():
        if name not in _OPTIONS:
            raise TypeError(f"there is no option {name}; there are {', '.join(_OPTIONS)}")
        setattr(desc, name, value)
    if start is not None:
        desc.start = type(desc.start)(*flat("start", start, (12, 16))[:12])
    desc.viewer = type(desc.viewer)(*flat("viewer", viewer, (3,)))
    return desc


_OPTIONS = (
    "max_turn_rad",
    "max_shift_mm",
    "starts",
    "point_error_mm",
    "model_error_mm",
    "max_residual_mm",
    "min_inlier_share",
    "max_error_mm",
    "deformation_mm",
)


def _address(
    name: str, value: ArrayLike, columns: int, code: str, count: int, keep: List[Any]
) -> int:
    rows = Points(name, value, columns, code)
    _expect_count(name, rows.count, count)
    keep.append(rows)
    return rows.address


def _bytes(name: str, value: Iterable[int]) -> Any:
    try:
        given = bytes(bytearray(int(each) for each in value))
    except TypeError:
        raise TypeError(f"{name}: integers expected, {value!r} given") from None
    return (ctypes.c_uint8 * len(given)).from_buffer_copy(given)


def _expect_count(name: str, count: int, expected: int) -> None:
    if count != expected:
        raise ValueError(f"{name} has {count} rows, {expected} expected")


def _open(name: str, value: Any, kind: Any) -> Any:
    if not isinstance(value, kind):
        raise TypeError(f"{name} is a {kind.__name__}, {value!r} given")
    return value._open()
