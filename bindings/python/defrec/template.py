"""Templates: the surface that a tracker follows."""
from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple, Union

from . import structs
from ._arrays import (
    ArrayLike,
    BoolArray,
    ByteArray,
    Float32Array,
    FloatArray,
    IndexArray,
    Points,
    RecordArray,
    address_of,
    copied,
    empty,
)
from ._handle import Handle
from ._library import c_path, native, wait_in_slices
from .body import BodyRegion, MeshLike, body_desc
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
    """What a template consists of; copies. mm, template frame: the rectified left camera of the
    frame that gave it."""

    size: Tuple[int, int]
    """Width and height of the rectified image it was taken from, px."""
    camera: Camera
    vertices: RecordArray
    """(n,) SurfacePoint"""
    triangles: IndexArray
    """(n, 3) uint32, vertices, counter-clockwise seen from the camera"""
    nodes: Float32Array
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
    """(n,) CutPoint, of the lines along which tissue came apart; a triangle that one crosses has
    three equal corners"""
    vertex_pieces: ByteArray
    """(n,) uint8, piece of the surface per vertex, from 0; no triangle and no edge leads from one
    to another"""


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
            lambda out: native.defrec_template_load(handle, name, out),
            native.defrec_template_release,
            keep,
        )

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes a file that holds the template. threads: any. Raises Error."""
        native.defrec_template_save(self._native, c_path("path", path))

    def lift(self, uv: ArrayLike) -> Lifted:
        """Finds the surface points under (n, 2) pixels of the rectified left image that gave the
        template (Rig.rectify_pixels). threads: any"""
        given = Points("uv", uv, 2)
        xyz, found = empty("d", (given.count, 3)), empty("?", (given.count,))
        native.defrec_template_lift(
            self._native, given.address, given.count, address_of(xyz), address_of(found)
        )
        return Lifted(xyz, found)

    def point_pieces(self, template_xyz: ArrayLike) -> ByteArray:
        """Which piece of the surface (n, 3) points of the template frame, mm, belong to, on the
        surface or off it, and with which Job.warp_points moves them: (n,) uint8; 255 for a point
        that is not finite. threads: any"""
        given = Points("template_xyz", template_xyz, 3)
        pieces: ByteArray = empty("B", (given.count,))
        native.defrec_template_point_pieces(
            self._native, given.address, given.count, address_of(pieces)
        )
        return pieces

    def set_body(
        self,
        mesh: Optional[MeshLike] = None,
        regions: Sequence[BodyRegion] = (),
        *,
        poisson_ratio: float = 0,
        cut_depth_mm: float = 0,
    ) -> None:
        """Sets the elastic body that the surface belongs to, from then on and in all trackers that
        follow it or what it becomes by growing or by a cut. Everything is copied. A body that is
        being computed is given up, and that before is used until the new one is ready. Saved with
        the template.

        mesh: closed, of the whole body, template frame: (vertices, triangles), (n, 3) mm and (n, 3)
            indices of vertices, counter-clockwise seen from outside; None: the tissue beneath the
            surface, whose extent is not known.
        regions: parts that are stiffer or softer, or held; where they overlap the last one counts;
            at most 64.
        poisson_ratio: of the tissue; 0.01 to 0.495; default 0.43.
        cut_depth_mm: how deep a cut parts the body; 0.1 to 1000; default 10.

        Without arguments it is the body that a template has by itself. threads: any. Raises Error
        for a number out of its range and for a mesh that is not closed, is inside out, intersects
        itself, has a size that is not one in mm, or does not meet the surface; TypeError and
        ValueError for arrays of another type or shape.
        """
        keep: List[Any] = []  # the library reads it until the call returns
        desc = body_desc(mesh, regions, poisson_ratio, cut_depth_mm, keep)
        native.defrec_template_set_body(self._native, desc)

    def wait_body(self, timeout: Optional[float] = None) -> bool:
        """Waits until the body beneath the surface is ready, at most timeout seconds; None: for
        ever. False: not yet. Starts computing it where nobody has. What then is asked of a frame's
        points depends on the frames alone and not on time.

        threads: any. Raises Error, with Status.ERROR_UNSUPPORTED where no body can be made of it.
        """
        return wait_in_slices(
            lambda ns: native.defrec_template_wait_body(self._native, ns), timeout
        )

    def data(self) -> TemplateData:
        """Copies everything the template consists of. threads: any"""
        info = structs.TemplateInfo()
        with self._copying() as handle:
            native.defrec_template_get(handle, info)
            return _copy_template(info)


class Targets(Handle):
    """Points of a plan, on the surface or beneath it, prepared once to be moved in many frames:
    Job.move_targets.

    template_xyz: (n, 3), mm, template frame; copied. What is not finite is unknown in every frame.
        At most 1,000,000.

    They follow the template and what it becomes by growing or by a cut. len() says how many there
    are. threads: any. Raises Error.
    """

    def __init__(self, template: Template, template_xyz: ArrayLike) -> None:
        if not isinstance(template, Template):
            raise TypeError(f"template is a Template, {template!r} given")
        given = Points("template_xyz", template_xyz, 3)
        handle, keep = template._open()
        super().__init__(
            lambda out: native.defrec_targets_create(handle, given.address, given.count, out),
            native.defrec_targets_destroy,
            keep,
        )
        # As many as the library says that there are: as many it writes in each frame.
        self._count = int(native.defrec_targets_count(self._native))

    def __len__(self) -> int:
        return self._count

    def __bool__(self) -> bool:
        return True

    def __repr__(self) -> str:
        return f"<Targets, {self._count}{', closed' if self.is_closed else ''}>"


def _copy_template(info: structs.TemplateInfo) -> TemplateData:
    def records(address: Any, struct: Any, count: int) -> RecordArray:
        made: RecordArray = copied(address, struct, (count,))
        return made

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
