"""Plans: a registered model and its targets, kept in a file and followed in each frame."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from typing import Any, List, NamedTuple, Sequence, Union

from . import structs
from ._arrays import ArrayLike, Float32Array, FloatArray, IndexArray, Points, copied
from ._handle import Handle
from ._library import c_path, c_text, native, text
from .body import MeshLike
from .enums import PlanFlag, Verdict
from .registration import Registration, numbers
from .template import Template


class PlanPart(NamedTuple):
    """A named part of a plan's model: a tumour, a vessel."""

    name: str
    """1 to 255 bytes of UTF-8."""
    first_triangle: int
    triangle_count: int
    """Its triangles follow one another."""


@dataclass(frozen=True)
class PlanData:
    """What a plan consists of, at rest; copies. mm. Points are the vertices, then the targets."""

    verdict: Verdict
    """The registration's."""
    transform: FloatArray
    """(3, 4), template frame from model frame."""
    covariance: FloatArray
    """(6, 6), as in RegistrationResult."""
    vertices: Float32Array
    """(n, 3) float32, model frame"""
    triangles: IndexArray
    """(n, 3) uint32, vertices"""
    parts: List[PlanPart]
    targets: FloatArray
    """(n, 3), model frame"""
    target_names: List[str]
    """Name of each target; "" for one without."""
    template_xyz: FloatArray
    """(n, 3), of each point, template frame"""
    registration_error_mm: FloatArray
    """(n,), of each point the target registration error"""
    deformed: bool
    """The registration deformed the model: template_xyz is not what transform makes of it."""


class Plan(Handle):
    """A preoperative model and targets, registered to a template once: Job.move_plan.

    registration: its seen frame is the template frame; it is copied. model: vertices and triangles,
        model frame, mm. parts: of its triangles. targets: (n, 3), model frame, mm.
    target_names: of each target, "" for one without, else no two alike; (): none has one.
    looked_at: a person has looked at the registration, so that its verdict may be another than
        Verdict.ACCEPTED, but for Verdict.FAILED.

    It follows the template and what it becomes by growing or by a cut. len() says how many points
    it has: vertices, then targets; at most 1,000,000. threads: any. Raises Error.
    """

    def __init__(
        self,
        template: Template,
        registration: Registration,
        model: MeshLike = ((), ()),
        *,
        parts: Sequence[PlanPart] = (),
        targets: ArrayLike = (),
        target_names: Sequence[str] = (),
        looked_at: bool = False,
    ) -> None:
        if not isinstance(registration, Registration):
            raise TypeError(f"registration is a Registration, {registration!r} given")
        surface = _template(template)
        keep: List[Any] = []
        desc = _desc(model, parts, targets, target_names, looked_at, keep)
        its_registration = registration._native
        super().__init__(
            lambda out: native.defrec_plan_create(surface[0], its_registration, desc, out),
            native.defrec_plan_destroy,
            surface[1],
        )
        self._count = int(self._info().point_count)

    @classmethod
    def load(cls, template: Template, path: Union[str, "os.PathLike[str]"]) -> "Plan":
        """Reads a file that save() wrote for this template: the same object, what it became, one
        that was saved and loaded, or one of the same first view. The file is checked. threads: any.
        Raises Error, with Status.ERROR_ARGUMENT for a plan of another template."""
        surface = _template(template)
        name = c_path("path", path)
        made = cls.__new__(cls)
        Handle.__init__(
            made,
            lambda out: native.defrec_plan_load(surface[0], name, out),
            native.defrec_plan_destroy,
            surface[1],
        )
        made._count = int(made._info().point_count)
        return made

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes a file that holds the plan. threads: any. Raises Error."""
        native.defrec_plan_save(self._native, c_path("path", path))

    def data(self) -> PlanData:
        """Copies everything the plan consists of. threads: any"""
        with self._copying() as handle:
            info = structs.PlanInfo()
            native.defrec_plan_get(handle, info)
            return PlanData(
                verdict=Verdict(info.verdict),
                transform=numbers(info.transform, (3, 4)),
                covariance=numbers(info.covariance, (6, 6)),
                vertices=copied(info.vertices, "f", (info.vertex_count, 3)),
                triangles=copied(info.triangles, "I", (info.triangle_count, 3)),
                parts=_parts(info),
                targets=copied(info.targets, "d", (info.target_count, 3)),
                target_names=_target_names(info),
                template_xyz=copied(info.template_xyz, "d", (info.point_count, 3)),
                registration_error_mm=copied(info.registration_error_mm, "d", (info.point_count,)),
                deformed=info.deformed != 0,
            )

    def point_of(self, name: str) -> int:
        """Index of the point that is the target of that name. threads: any. Raises KeyError where
        there is none."""
        with self._copying() as handle:
            info = structs.PlanInfo()
            native.defrec_plan_get(handle, info)
            names = _target_names(info)
        if not name or name not in names:
            raise KeyError(name)
        return int(info.vertex_count) + names.index(name)

    def _info(self) -> structs.PlanInfo:
        info = structs.PlanInfo()
        native.defrec_plan_get(self._native, info)
        return info

    def __len__(self) -> int:
        return self._count

    def __bool__(self) -> bool:
        return True

    def __repr__(self) -> str:
        return f"<Plan, {self._count}{', closed' if self.is_closed else ''}>"


def _template(template: Template) -> Any:
    if not isinstance(template, Template):
        raise TypeError(f"template is a Template, {template!r} given")
    return template._open()


def _parts(info: structs.PlanInfo) -> List[PlanPart]:
    if info.part_count == 0:
        return []
    parts = (structs.PlanPart * info.part_count).from_address(info.parts)
    return [PlanPart(text(part.name), part.first_triangle, part.triangle_count) for part in parts]


def _target_names(info: structs.PlanInfo) -> List[str]:
    if info.target_count == 0:
        return []
    names = (ctypes.c_char_p * info.target_count).from_address(info.target_names)
    return [text(name) for name in names]


def _desc(
    model: MeshLike,
    parts: Sequence[PlanPart],
    targets: ArrayLike,
    target_names: Sequence[str],
    looked_at: bool,
    keep: List[Any],
) -> structs.PlanDesc:
    """The description; what it points to lives as long as keep does."""
    try:
        vertices, triangles = model
    except (TypeError, ValueError):
        raise TypeError(
            f"model: vertices and triangles expected, {type(model).__name__} given"
        ) from None
    points = Points("model.vertices", vertices, 3, "f")
    corners = Points("model.triangles", triangles, 3, "I")
    places = Points("targets", targets, 3)
    named = (structs.PlanPart * len(parts))()
    for i, part in enumerate(parts):
        name, first, count = part
        named[i].name = c_text(f"parts[{i}].name", name)
        named[i].first_triangle, named[i].triangle_count = first, count
    if len(target_names) not in (0, places.count):
        raise ValueError(
            f"target_names has {len(target_names)} names, there are {places.count} targets"
        )
    names = (ctypes.c_char_p * len(target_names))()
    for i, name in enumerate(target_names):
        names[i] = c_text(f"target_names[{i}]", name)
    keep += [points, corners, places, named, names]
    return structs.PlanDesc(
        flags=PlanFlag.LOOKED_AT if looked_at else 0,
        vertices=points.address if points.count else None,
        vertex_count=points.count,
        triangles=corners.address if corners.count else None,
        triangle_count=corners.count,
        parts=ctypes.addressof(named) if len(parts) else None,
        part_count=len(parts),
        targets=places.address if places.count else None,
        target_count=places.count,
        target_names=ctypes.addressof(names) if len(target_names) else None,
    )
