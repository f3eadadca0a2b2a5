"""Templates: the surface that a tracker follows."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from typing import Any, List, NamedTuple, Optional, Sequence, Tuple, Union

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
from .enums import REGION_HELD, Status
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


class BodyMesh(NamedTuple):
    """A closed triangle mesh in the template frame."""

    vertices: ArrayLike
    """(n, 3), mm"""
    triangles: ArrayLike
    """(n, 3) vertex indices, counter-clockwise seen from outside"""


class BodyPart(NamedTuple):
    """A part of a body that is stiffer or softer than the rest, or held."""

    mesh: BodyMesh
    stiffness: float = 0
    """Young's modulus relative to the rest of the body, 0.01 to 1000; 0: 1"""
    is_held: bool = False
    """It moves with the held_motion of Tracker.submit, or with the deep tissue where that is not given."""


class Body(NamedTuple):
    """The elastic body that a template surface belongs to."""

    mesh: Optional[BodyMesh] = None
    """Of the whole body; None: the tissue beneath the surface, whose extent is not known."""
    regions: Sequence[BodyPart] = ()
    """At most 64; where they overlap the last one counts."""
    poisson_ratio: float = 0
    """0.01 to 0.495; 0: 0.43"""
    cut_depth_mm: float = 0
    """How deep a cut parts the body, 0.1 to 1000; 0: 10"""


def _native_mesh(mesh: BodyMesh, keep: List[Any]) -> structs.Mesh:
    def packed(name: str, given: ArrayLike, code: str) -> Tuple[Any, int]:
        values = Points(name, given, 3)
        count = 3 * values.count
        doubles: Any = (ctypes.c_double * count).from_address(values.address) if count else ()
        kind: Any = ctypes.c_float if code == "f" else ctypes.c_uint32
        array = (kind * count)(*(doubles if code == "f" else (int(value) for value in doubles)))
        keep.append(array)
        return (ctypes.addressof(array) if count else None), values.count

    made = structs.Mesh()
    made.vertices, made.vertex_count = packed("vertices", mesh.vertices, "f")
    made.triangles, made.triangle_count = packed("triangles", mesh.triangles, "I")
    return made


class Targets(Handle):
    """Points of a plan, prepared once to be moved in many frames: Job.move_targets. They follow their template and what it
    becomes by growing or by a cut.

    template_xyz: (n, 3), mm, template frame. threads: any. Raises Error for more than 1,000,000.
    """

    def __init__(self, surface: "Template", template_xyz: ArrayLike):
        if not isinstance(surface, Template):
            raise TypeError(f"surface is a Template, {surface!r} given")
        handle, keep = surface._open()
        given = Points("template_xyz", template_xyz, 3)
        super().__init__(
            lambda out: native.defrec_targets_create(handle, given.address, given.count, out),
            native.defrec_targets_destroy,
            keep,
        )

    def __len__(self) -> int:
        return int(native.defrec_targets_count(self._native))


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

    def set_body(self, body: Optional[Body]) -> None:
        """Sets the body that the surface belongs to, from then on and in all trackers that follow it or what it becomes by
        growing or by a cut; None: the tissue beneath the surface. It is copied. threads: any. Raises Error."""
        if body is None:
            native.defrec_template_set_body(self._native, None)
            return
        keep: List[Any] = []
        desc = structs.BodyDesc(poisson_ratio=body.poisson_ratio, cut_depth_mm=body.cut_depth_mm)
        if body.mesh is not None:
            desc.mesh = _native_mesh(body.mesh, keep)
        regions = (structs.BodyRegion * len(body.regions))()
        for region, made in zip(body.regions, regions):
            made.mesh = _native_mesh(region.mesh, keep)
            made.stiffness = region.stiffness
            made.flags = REGION_HELD if region.is_held else 0
        desc.regions = ctypes.addressof(regions) if body.regions else None
        desc.region_count = len(body.regions)
        native.defrec_template_set_body(self._native, desc)

    def wait_body(self, timeout: Optional[float] = None) -> bool:
        """Waits for the body beneath the surface, at most timeout seconds; None: for ever. False: it is not ready. What is
        asked of a frame's points afterwards depends on the frames alone. threads: any. Raises Error."""
        if timeout is not None and not timeout >= 0:
            raise ValueError(f"timeout is {timeout}, seconds of at least 0 expected")
        timeout_ns = 2**64 - 1 if timeout is None or timeout >= 2**32 else int(timeout * 1e9)
        return bool(native.defrec_template_wait_body(self._native, timeout_ns) != Status.TIMEOUT)

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
