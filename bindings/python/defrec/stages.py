"""The stages, each taking and giving arrays. docs/stages.md defines what they compute.

Images are (height, width) and have no gaps between rows; for strides, and for the results of
sub-stages, use Stage. What is None is left out. Records come as arrays of them (structs.py).
Results are new arrays. threads: any for different stages, one at a time for the same one
(BusyError). Raises Error; TypeError and ValueError for arrays of another type or shape.
"""
from __future__ import annotations

import ctypes
from typing import Any, NamedTuple, Optional, Tuple, Type

from ._arrays import (
    BufferLike,
    ByteArray,
    DisparityArray,
    RecordArray,
    bytes_per_pixel,
    check_image,
    check_numbers,
    check_records,
    empty,
    head,
)
from ._struct import Struct
from .context import Context
from .stage import Stage
from .structs import (
    AlignParams,
    Edge,
    Feature,
    Landmark,
    LmParams,
    LmSummary,
    Match,
    MatchParams,
    Motion,
    OrbParams,
    Patch,
    PatchObservation,
    PatchPrediction,
    RansacParams,
    RansacSummary,
    RectifyParams,
    StereoParams,
    SurfacePoint,
    SurfaceSample,
    WarpParams,
)


class Rectified(NamedTuple):
    gray: ByteArray
    """(height, width) uint8"""
    mask: ByteArray
    """(height, width) uint8: 255 usable, 0 not"""


class Disparity(NamedTuple):
    disparity: DisparityArray
    """(height, width) int16, 1/16 px, DISPARITY_NONE for a hole"""
    confidence: ByteArray
    """(height, width) uint8: 0 in holes, else 1 to 255"""


class Aligned(NamedTuple):
    observations: RecordArray
    """(patches,) PatchObservation, zero where not found"""
    predictions: RecordArray
    """(patches,) PatchPrediction, as computed or as given"""


class Preselected(NamedTuple):
    matches: RecordArray
    """(landmarks,) Match with weights"""
    summary: RansacSummary


class Solved(NamedTuple):
    motions: RecordArray
    """(nodes,) Motion"""
    summary: LmSummary


class _ArrayStage(Stage):
    params: Any

    def __init__(self, context: Context, params: Any, device_id: Optional[str] = None) -> None:
        expected = self._params_type
        if not isinstance(params, expected):
            raise TypeError(f"params is of type {expected.__name__}, {params!r} given")
        self.params = expected.from_buffer_copy(params)
        self._set_defaults()
        if getattr(self.params, "stride", 0) not in (0, getattr(self.params, "width", 0)):
            raise ValueError(
                f"stride is {self.params.stride}; images have no gaps between rows here, use Stage"
            )
        super().__init__(context, self.params, device_id)

    _params_type: Type[Struct]

    def _set_defaults(self) -> None:
        """Sets the defaults that the arrays' shapes depend on."""

    @property
    def _shape(self) -> Tuple[int, int]:
        return self.params.height, self.params.width

    def _image(self, name: str, value: BufferLike) -> BufferLike:
        check_image(name, value, self.params.width, self.params.height, 1)
        return value

    def _mask(self, name: str, value: Optional[BufferLike]) -> Optional[BufferLike]:
        if value is not None:
            check_image(name, value, self.params.width, self.params.height, 1, "B?")
        return value

    def _disparity(self, value: Optional[BufferLike]) -> Optional[BufferLike]:
        if value is not None:
            check_numbers("disparity", value, "h", self._shape)
        return value


class RectifyStage(_ArrayStage):
    """Raw pixels to gray ones of the rectified camera, and a mask of what is usable."""

    _params_type = RectifyParams

    def _set_defaults(self) -> None:
        p = self.params
        p.width, p.height = p.width or p.source_width, p.height or p.source_height
        if p.source_stride not in (0, p.source_width * bytes_per_pixel(p.format)):
            raise ValueError(
                f"source_stride is {p.source_stride}; images have no gaps between rows here, use"
                " Stage"
            )

    def run(
        self,
        source: BufferLike,
        map: Optional[BufferLike] = None,
        ignore: Optional[BufferLike] = None,
    ) -> Rectified:
        """source: uint8, (source_height, source_width, channels). map: (height, width, 2) int32,
        where in the source each pixel comes from (x, y), 1/128 px; None: from the same place.
        ignore: (source_height, source_width) uint8 or bool, nonzero: not tissue."""
        p = self.params
        check_image("source", source, p.source_width, p.source_height, bytes_per_pixel(p.format))
        if map is not None:
            check_numbers("map", map, "i", (*self._shape, 2))
        if ignore is not None:
            check_image("ignore", ignore, p.source_width, p.source_height, 1, "B?")
        gray, mask = empty("B", self._shape), empty("B", self._shape)
        self.run_buffers([source, map, ignore], [gray, mask])
        return Rectified(gray, mask)


class StereoStage(_ArrayStage):
    """Disparity of the left image."""

    _params_type = StereoParams

    def run(
        self,
        left: BufferLike,
        right: BufferLike,
        left_mask: Optional[BufferLike] = None,
        right_mask: Optional[BufferLike] = None,
    ) -> Disparity:
        """left, right: (height, width) uint8, rectified gray. Masks: likewise, nonzero usable;
        None: all is."""
        inputs = [
            self._image("left", left),
            self._image("right", right),
            self._mask("left_mask", left_mask),
            self._mask("right_mask", right_mask),
        ]
        disparity, confidence = empty("h", self._shape), empty("B", self._shape)
        self.run_buffers(inputs, [disparity, confidence])
        return Disparity(disparity, confidence)


class OrbStage(_ArrayStage):
    """Corners with a descriptor."""

    _params_type = OrbParams

    def _set_defaults(self) -> None:
        self.params.capacity = self.params.capacity or self.params._defaults_["capacity"]

    def run(self, gray: BufferLike, mask: Optional[BufferLike] = None) -> RecordArray:
        """gray: (height, width) uint8. mask: likewise, nonzero usable. Gives (n,) Feature."""
        inputs = [self._image("gray", gray), self._mask("mask", mask)]
        count, features = empty("I", (1,)), empty(Feature, (self.params.capacity,))
        self.run_buffers(inputs, [count, features])
        found: RecordArray = head(features, count[0])
        return found


class MatchStage(_ArrayStage):
    """A live feature for each landmark."""

    _params_type = MatchParams
    _landmarks: Optional[int] = None

    def prepare(self, landmarks: BufferLike) -> None:
        """landmarks: (n,) Landmark, at most params.landmarks."""
        given, count = check_records("landmarks", landmarks, Landmark, most=self.params.landmarks)
        self.prepare_buffers([given])
        self._landmarks = count

    def run(self, features: BufferLike, disparity: BufferLike) -> RecordArray:
        """features: (m,) Feature. disparity: (height, width) int16, 1/16 px. Gives (n,) Match."""
        given, count = check_records("features", features, Feature)
        matches: RecordArray = empty(Match, (self._landmarks or 0,))
        self.run_buffers(
            [(ctypes.c_uint32 * 1)(count), given, self._disparity(disparity)], [matches]
        )
        return matches


class AlignStage(_ArrayStage):
    """Where the template's patches are in the live image."""

    _params_type = AlignParams
    _patches: Optional[int] = None

    def _set_defaults(self) -> None:
        self.params.views = self.params.views or self.params._defaults_["views"]

    def prepare(self, patches: BufferLike, views: BufferLike) -> None:
        """patches: (n,) Patch, at most params.patches. views: (views, height, width) uint8, one
        alone (height, width)."""
        given, count = check_records("patches", patches, Patch, most=self.params.patches)
        shape = (self.params.views, *self._shape)
        check_numbers(
            "views", views, "B", shape, *([self._shape] if self.params.views == 1 else [])
        )
        self.prepare_buffers([given, views])
        self._patches = count

    def run(
        self,
        gray: BufferLike,
        mask: Optional[BufferLike] = None,
        *,
        motions: Optional[BufferLike] = None,
        predictions: Optional[BufferLike] = None,
    ) -> Aligned:
        """gray, mask: (height, width) uint8. One of: motions, (nodes,) Motion; predictions, (n,)
        PatchPrediction."""
        inputs = [
            self._image("gray", gray),
            self._mask("mask", mask),
            _optional_records("motions", motions, Motion, self.params.nodes),
            _optional_records("predictions", predictions, PatchPrediction, self._patches),
        ]
        count = self._patches or 0
        observations, made = empty(PatchObservation, (count,)), empty(PatchPrediction, (count,))
        self.run_buffers(inputs, [observations, made])
        return Aligned(observations, made)


class RansacStage(_ArrayStage):
    """Which matches move together."""

    _params_type = RansacParams
    _landmarks: Optional[int] = None

    def prepare(self, landmarks: BufferLike) -> None:
        """landmarks: (n,) Landmark, at most params.landmarks."""
        given, count = check_records("landmarks", landmarks, Landmark, most=self.params.landmarks)
        self.prepare_buffers([given])
        self._landmarks = count

    def run(self, matches: BufferLike) -> Preselected:
        """matches: (n,) Match, of the stage match."""
        given, _ = check_records("matches", matches, Match, self._landmarks)
        weighted, summary = empty(Match, (self._landmarks or 0,)), RansacSummary()
        self.run_buffers([given], [weighted, summary])
        return Preselected(weighted, summary)


class LmStage(_ArrayStage):
    """The motions of the control points that fit best."""

    _params_type = LmParams

    def prepare(
        self,
        nodes: BufferLike,
        edges: BufferLike,
        points: BufferLike,
        landmarks: BufferLike,
        patches: BufferLike,
    ) -> None:
        """nodes: (nodes, 3) float32, mm. edges: Edge. points, landmarks: SurfacePoint. patches:
        Patch. As many as the parameters say."""
        p = self.params
        check_numbers("nodes", nodes, "f", (p.nodes, 3))
        self.prepare_buffers(
            [
                nodes,
                check_records("edges", edges, Edge, p.edges)[0],
                check_records("points", points, SurfacePoint, p.points)[0],
                check_records("landmarks", landmarks, SurfacePoint, p.landmarks)[0],
                check_records("patches", patches, Patch, p.patches)[0],
            ]
        )

    def run(
        self,
        motions: BufferLike,
        matches: Optional[BufferLike] = None,
        observations: Optional[BufferLike] = None,
        disparity: Optional[BufferLike] = None,
    ) -> Solved:
        """motions: (nodes,) Motion, where to start. matches: (landmarks,) Match, of ransac.
        observations: (patches,) PatchObservation, of align. disparity: (height, width) int16, 1/16
            px."""
        p = self.params
        inputs = [
            check_records("motions", motions, Motion, p.nodes)[0],
            _optional_records("matches", matches, Match, p.landmarks),
            _optional_records("observations", observations, PatchObservation, p.patches),
            self._disparity(disparity),
        ]
        solved, summary = empty(Motion, (p.nodes,)), LmSummary()
        self.run_buffers(inputs, [solved, summary])
        return Solved(solved, summary)


class WarpStage(_ArrayStage):
    """Surface points moved by the control points, and what the frame says of them."""

    _params_type = WarpParams

    def prepare(self, points: BufferLike) -> None:
        """points: (points,) SurfacePoint."""
        self.prepare_buffers([check_records("points", points, SurfacePoint, self.params.points)[0]])

    def run(self, motions: BufferLike, disparity: Optional[BufferLike] = None) -> RecordArray:
        """motions: (nodes,) Motion. disparity: (height, width) int16, 1/16 px. Gives (points,)
        SurfaceSample."""
        given, _ = check_records("motions", motions, Motion, self.params.nodes)
        samples: RecordArray = empty(SurfaceSample, (self.params.points,))
        self.run_buffers([given, self._disparity(disparity)], [samples])
        return samples


def _optional_records(
    name: str, value: Optional[BufferLike], struct: Type[Struct], count: Optional[int]
) -> Optional[BufferLike]:
    return None if value is None else check_records(name, value, struct, count)[0]
