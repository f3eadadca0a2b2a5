"""Templates: the surface that a tracker follows."""
from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, NamedTuple, Tuple, Union

from . import structs
from ._arrays import (
    ArrayLike,
    BoolArray,
    ByteArray,
    FloatArray,
    IndexArray,
    Points,
    RecordArray,
    address_of,
    copied,
    empty,
)
from ._handle import Handle
from ._library import c_path, native
from .context import Context
from .structs import Camera, CutPoint, Edge, Landmark, Patch, SurfacePoint


class Lifted(NamedTuple):
    """Points of the surface under pixels."""

    xyz: FloatArray
    """(n, 3) float64, mm, template frame; 0 where nothing was found."""
    found: BoolArray
    """(n,) bool: the template has a surface there."""


@dataclass(frozen=True)
class TemplateData:
    """What a template consists of; copies. mm, template frame: the rectified left camera of the frame that gave it."""

    size: Tuple[int, int]
    """Width and height of the rectified image it was taken from, px."""
    camera: Camera
    vertices: RecordArray
    """(n,) SurfacePoint"""
    triangles: IndexArray
    """(n, 3) uint32, vertices, counter-clockwise seen from the camera"""
    nodes: FloatArray
    """(n, 3) float32, control points"""
    edges: RecordArray
    """(n,) Edge"""
    landmarks: RecordArray
    """(n,) Landmark"""
    patches: RecordArray
    """(n,) Patch"""
    image: ByteArray
    """(height, width) uint8, the rectified left image"""
    cut_points: RecordArray
    """(n,) CutPoint, of the lines along which tissue came apart; a triangle that one crosses has three equal corners"""
    vertex_pieces: ByteArray
    """(n,) uint8, piece of the surface per vertex, from 0; no triangle and no edge leads from one to another"""


class Template(Handle):
    """A surface at rest. Tracker.template() and Template.load() make it."""

    @classmethod
    def load(cls, context: Context, path: Union[str, "os.PathLike[str]"]) -> "Template":
        """Reads a file that save() wrote; it is checked. threads: any. Raises Error."""
        if not isinstance(context, Context):
            raise TypeError(f"context is a Context, {context!r} given")
        handle, keep = context._open()
        name = c_path("path", path)
        return cls(
            lambda out: native.defrec_template_load(handle, name, out), native.defrec_template_release, keep
        )

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes a file that holds the template. threads: any. Raises Error."""
        native.defrec_template_save(self._native, c_path("path", path))

    def lift(self, uv: ArrayLike) -> Lifted:
        """Finds the surface points under (n, 2) pixels of the rectified left image that gave the template
        (Rig.rectify_pixels). threads: any"""
        given = Points("uv", uv, 2)
        xyz, found = empty("d", (given.count, 3)), empty("?", (given.count,))
        native.defrec_template_lift(self._native, given.address, given.count, address_of(xyz), address_of(found))
        return Lifted(xyz, found)

    def point_pieces(self, template_xyz: ArrayLike) -> ByteArray:
        """Which piece of the surface (n, 3) points of the template frame, mm, belong to, on the surface or off it, and
        with which Job.warp_points moves them: (n,) uint8; 255 for a point that is not finite. threads: any"""
        given = Points("template_xyz", template_xyz, 3)
        pieces = empty("B", (given.count,))
        native.defrec_template_point_pieces(self._native, given.address, given.count, address_of(pieces))
        return pieces

    def data(self) -> TemplateData:
        """Copies everything the template consists of. threads: any"""
        info = structs.TemplateInfo()
        with self._copying() as handle:
            native.defrec_template_get(handle, info)
            return _copy_template(info)


def _copy_template(info: structs.TemplateInfo) -> TemplateData:
    def records(address: Any, struct: Any, count: int) -> RecordArray:
        return copied(address, struct, (count,))

    return TemplateData(
        size=(info.width, info.height),
        camera=Camera.from_buffer_copy(info.camera),
        vertices=records(info.vertices, SurfacePoint, info.vertex_count),
        triangles=copied(info.triangles, "I", (info.triangle_count, 3)),
        nodes=copied(info.nodes, "f", (info.node_count, 3)),
        edges=records(info.edges, Edge, info.edge_count),
        landmarks=records(info.landmarks, Landmark, info.landmark_count),
        patches=records(info.patches, Patch, info.patch_count),
        image=copied(info.image, "B", (info.height, info.width)),
        cut_points=records(info.cut_points, CutPoint, info.cut_point_count),
        vertex_pieces=copied(info.vertex_pieces, "B", (info.vertex_count,)),
    )
