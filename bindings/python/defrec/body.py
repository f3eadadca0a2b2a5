"""The elastic body beneath a template: Template.set_body."""
from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple, Union

from . import structs
from ._arrays import ArrayLike, Points
from .enums import RegionFlag


class Mesh(NamedTuple):
    """A triangle mesh in the template frame."""

    vertices: ArrayLike
    """(n, 3), mm; float32 is used in place, other numbers are converted."""
    triangles: ArrayLike
    """(n, 3) indices of vertices, counter-clockwise seen from outside; uint32 is used in place."""


MeshLike = Union[Mesh, Tuple[ArrayLike, ArrayLike]]
"""Vertices and triangles."""


@dataclass(frozen=True, eq=False)
class BodyRegion:
    """A part of a body that is stiffer or softer than the rest, or held."""

    mesh: MeshLike
    """Closed; what lies in it."""
    stiffness: float = 0
    """Young's modulus relative to the rest of the body; 0.01 to 1000; default 1."""
    held: bool = False
    """It moves with held_motion of Tracker.submit, or with the deep tissue where that is not
    given."""


def body_desc(
    mesh: Optional[MeshLike],
    regions: Sequence[BodyRegion],
    poisson_ratio: float,
    cut_depth_mm: float,
    keep: List[Any],
) -> Optional[structs.BodyDesc]:
    """The description, None where nothing is described; what it points to lives as long as keep
    does."""
    if isinstance(regions, BodyRegion) or not isinstance(regions, Sequence):
        raise TypeError(f"regions: a list of BodyRegion expected, {regions!r} given")
    if mesh is None and len(regions) == 0 and poisson_ratio == 0 and cut_depth_mm == 0:
        return None
    desc = structs.BodyDesc(
        poisson_ratio=poisson_ratio, cut_depth_mm=cut_depth_mm, region_count=len(regions)
    )
    if mesh is not None:
        desc.mesh = _c_mesh("mesh", mesh, keep)
    c_regions = (structs.BodyRegion * len(regions))()
    for i, region in enumerate(regions):
        if not isinstance(region, BodyRegion):
            raise TypeError(f"regions[{i}] is a BodyRegion, {region!r} given")
        c_regions[i].mesh = _c_mesh(f"regions[{i}].mesh", region.mesh, keep)
        c_regions[i].stiffness = region.stiffness
        c_regions[i].flags = RegionFlag.HELD if region.held else 0
    keep.append(c_regions)
    if len(regions) > 0:
        desc.regions = ctypes.addressof(c_regions)
    return desc


def _c_mesh(name: str, mesh: MeshLike, keep: List[Any]) -> structs.Mesh:
    try:
        vertices, triangles = mesh
    except (TypeError, ValueError):
        raise TypeError(
            f"{name}: vertices and triangles expected, {type(mesh).__name__} given"
        ) from None
    points = Points(f"{name}.vertices", vertices, 3, "f")
    corners = Points(f"{name}.triangles", triangles, 3, "I")
    keep += [points, corners]
    return structs.Mesh(
        vertices=points.address if points.count > 0 else None,
        vertex_count=points.count,
        triangles=corners.address if corners.count > 0 else None,
        triangle_count=corners.count,
    )
