"""The structs of defrec_c.h, field for field; the header says what each field means.

Records (Feature, Landmark, ...) are what arrays hold: a NumPy array of them has the dtype numpy.dtype(Feature), without
NumPy it is a ctypes array. Parameters (StereoParams, ...) are made with keywords, StereoParams(width=640, height=480);
what is not named is 0, which means default.
"""
from __future__ import annotations

import ctypes
import operator
from typing import Annotated, Any, Callable, Dict, Type, TypeVar, get_type_hints

from .enums import MAX_TIMED_STAGES, SKIN_NODES

I16 = Annotated[int, ctypes.c_int16]
U16 = Annotated[int, ctypes.c_uint16]
I32 = Annotated[int, ctypes.c_int32]
U32 = Annotated[int, ctypes.c_uint32]
I64 = Annotated[int, ctypes.c_int64]
U64 = Annotated[int, ctypes.c_uint64]
Size = Annotated[int, ctypes.c_size_t]
F32 = Annotated[float, ctypes.c_float]
F64 = Annotated[float, ctypes.c_double]
Address = Annotated[Any, ctypes.c_void_p]
Text = Annotated[Any, ctypes.c_char_p]
Descriptor = Annotated[Any, ctypes.c_uint32 * 8]
F32x3 = Annotated[Any, ctypes.c_float * 3]
F32x4 = Annotated[Any, ctypes.c_float * 4]
F32x9 = Annotated[Any, ctypes.c_float * 9]
F64x3 = Annotated[Any, ctypes.c_double * 3]
F64x9 = Annotated[Any, ctypes.c_double * 9]
F64x12 = Annotated[Any, ctypes.c_double * 12]
F64x14 = Annotated[Any, ctypes.c_double * 14]
I32x4 = Annotated[Any, ctypes.c_int32 * 4]
SkinNodes = Annotated[Any, ctypes.c_int32 * SKIN_NODES]
SkinWeights = Annotated[Any, ctypes.c_float * SKIN_NODES]


def fitting(name: str, value: Any, c_type: Any) -> int:
    """The integer, if it is one that fits the C type; ctypes would cut it."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is an integer, {value!r} given") from None
    bits = 8 * ctypes.sizeof(c_type)
    least, most = (-(1 << bits - 1), (1 << bits - 1) - 1) if c_type._type_.islower() else (0, (1 << bits) - 1)
    if not least <= number <= most:
        raise ValueError(f"{name} is {number}, {least} to {most} expected")
    return number


class Struct(ctypes.Structure):
    """Refuses names that are no field and numbers that do not fit their field, which ctypes would take."""

    _c_types_: Dict[str, Any] = {}

    def __init__(self, **fields: Any) -> None:
        super().__init__()
        if "struct_size" in self._c_types_:
            self.struct_size = ctypes.sizeof(self)
        for name, value in fields.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._c_types_:
            raise AttributeError(f"{type(self).__name__} has no field {name}")
        code = getattr(self._c_types_[name], "_type_", None)
        if isinstance(code, str) and (code in "hHiIlLqQ" or code == "P" and isinstance(value, int)):
            value = fitting(f"{type(self).__name__}.{name}", value, self._c_types_[name])
        elif isinstance(code, str) and code in "fd":
            try:
                value = float(value)
            except (TypeError, ValueError, OverflowError):
                raise TypeError(f"{type(self).__name__}.{name} is a number, {value!r} given") from None
        super().__setattr__(name, value)

    def __repr__(self) -> str:
        shown = []
        for name in self._c_types_:
            value = getattr(self, name)
            if name != "struct_size" and not name.startswith("reserved"):
                shown.append(f"{name}={list(value) if isinstance(value, ctypes.Array) else value!r}")
        return f"{type(self).__name__}({', '.join(shown)})"

    def __eq__(self, other: object) -> bool:
        return type(self) is type(other) and bytes(self) == bytes(other)  # type: ignore[call-overload]

    __hash__ = None  # type: ignore[assignment]


C_STRUCTS: Dict[str, Type[Struct]] = {}
"""Every struct by its name in the header."""

S = TypeVar("S", bound=Type[Struct])


def c_struct(name: str) -> Callable[[S], S]:
    """Makes a class's annotations its C fields, in their order."""

    def declare(cls: S) -> S:
        hints = get_type_hints(cls, include_extras=True)
        fields = []
        for field in cls.__dict__["__annotations__"]:
            hint = hints[field]
            fields.append((field, hint.__metadata__[0] if hasattr(hint, "__metadata__") else hint))
        cls._fields_ = fields
        cls._c_types_ = dict(fields)
        cls.__doc__ = cls.__doc__ or f"{name}: defrec_c.h says what each field means."
        C_STRUCTS[name] = cls
        return cls

    return declare


# ---- context ----


@c_struct("defrec_context_desc")
class ContextDesc(Struct):
    struct_size: U32
    flags: U32
    plugin_paths: Address
    plugin_path_count: Size
    log: Address
    log_user: Address
    log_level: I32
    threads: U32
    alloc: Address
    free: Address
    alloc_user: Address
    parallel_for: Address
    parallel_for_user: Address


@c_struct("defrec_plugin_info")
class PluginInfoStruct(Struct):
    struct_size: U32
    verdict: I32
    name: Text
    path: Text
    version: Text
    reason: Text


@c_struct("defrec_device_info")
class DeviceInfoStruct(Struct):
    struct_size: U32
    kind: U32
    id: Text
    name: Text
    driver: Text
    memory_bytes: U64
    stages: U32
    features: U32
    conformance: U32
    reserved: U32


# ---- images and rigs ----


@c_struct("defrec_image")
class Image(Struct):
    struct_size: U32
    format: U32
    width: U32
    height: U32
    stride: U64
    pixels: Address
    memory: Address


@c_struct("defrec_intrinsics")
class Intrinsics(Struct):
    """One camera. px; distortion in OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tx ty."""

    fx: F64
    fy: F64
    cx: F64
    cy: F64
    distortion: F64x14
    distortion_count: U32
    reserved: U32


@c_struct("defrec_rig_desc")
class RigDesc(Struct):
    struct_size: U32
    flags: U32
    width: U32
    height: U32
    left: Intrinsics
    right: Intrinsics
    rotation: F64x9
    translation: F64x3


@c_struct("defrec_camera")
class Camera(Struct):
    """A pair of rectified cameras. px, mm."""

    fx: F64
    fy: F64
    cx: F64
    cy: F64
    baseline_mm: F64


@c_struct("defrec_rig_info")
class RigInfo(Struct):
    struct_size: U32
    identity: U32
    width: U32
    height: U32
    camera: Camera
    rotation: F64x9


# ---- records ----


@c_struct("defrec_feature")
class Feature(Struct):
    x: I32
    y: I32
    level: U16
    angle: U16
    score: U32
    descriptor: Descriptor


@c_struct("defrec_landmark")
class Landmark(Struct):
    descriptor: Descriptor
    position: F32x3
    reserved: U32


@c_struct("defrec_match")
class Match(Struct):
    feature: I32
    distance: I32
    second: I32
    u: F32
    v: F32
    position: F32x3
    weight: F32
    reserved: U32


@c_struct("defrec_surface_point")
class SurfacePoint(Struct):
    position: F32x3
    normal: F32x3
    node: SkinNodes
    weight: SkinWeights


@c_struct("defrec_patch")
class Patch(Struct):
    u: F32
    v: F32
    view: I32
    reserved: U32
    position: F32x3
    tangent_u: F32x3
    tangent_v: F32x3
    node: SkinNodes
    weight: SkinWeights
    reserved2: U32


@c_struct("defrec_patch_prediction")
class PatchPrediction(Struct):
    u: I32
    v: I32
    view_from_live: I32x4
    valid: I32
    reserved: I32


@c_struct("defrec_patch_observation")
class PatchObservation(Struct):
    u: I32
    v: I32
    score: I32
    valid: I32
    information: F32x3
    reserved: U32


@c_struct("defrec_motion")
class Motion(Struct):
    real: F32x4
    dual: F32x4


@c_struct("defrec_edge")
class Edge(Struct):
    a: I32
    b: I32
    weight: F32


@c_struct("defrec_surface_sample")
class SurfaceSample(Struct):
    position: F32x3
    normal: F32x3
    residual: F32
    observation: U32


@c_struct("defrec_ransac_summary")
class RansacSummary(Struct):
    valid_matches: I32
    references: I32
    inliers: I32
    best_support: I32
    rotation: F32x9
    translation: F32x3


@c_struct("defrec_lm_summary")
class LmSummary(Struct):
    initial_cost: F32
    final_cost: F32
    icp_cost: F32
    match_cost: F32
    patch_cost: F32
    arap_cost: F32
    iterations: I32
    icp_points: I32
    matches: I32
    patches: I32
    icp_rms: F32
    match_rms: F32
    patch_rms: F32
    damping: F32
    failed: I32
    reserved: U32


# ---- parameters of the stages: ranges and defaults stand in defrec_c.h ----


@c_struct("defrec_rectify_params")
class RectifyParams(Struct):
    struct_size: U32
    format: U32
    source_width: U32
    source_height: U32
    source_stride: U32
    width: U32
    height: U32
    stride: U32
    saturation: U32
    highlight_radius: U32


@c_struct("defrec_stereo_params")
class StereoParams(Struct):
    struct_size: U32
    width: U32
    height: U32
    stride: U32
    min_disparity: I32
    disparities: U32
    radius: U32
    refine_radius: U32
    min_score: U32
    refine_score: U32
    uniqueness: U32
    texture: U32
    left_right: U32
    edge: U32
    support: U32
    fill_radius: U32
    smooth_radius: U32
    smooth_range: U32
    smooth_passes: U32


@c_struct("defrec_orb_params")
class OrbParams(Struct):
    struct_size: U32
    width: U32
    height: U32
    stride: U32
    levels: U32
    cell: U32
    threshold: U32
    capacity: U32
    spacing: U32


@c_struct("defrec_match_params")
class MatchParams(Struct):
    struct_size: U32
    landmarks: U32
    features: U32
    max_distance: U32
    ratio: U32
    width: U32
    height: U32
    stride: U32
    camera: Camera


@c_struct("defrec_align_params")
class AlignParams(Struct):
    struct_size: U32
    patches: U32
    nodes: U32
    views: U32
    width: U32
    height: U32
    stride: U32
    level: U32
    patch_radius: U32
    search_radius: U32
    min_score: U32
    texture: U32
    camera: Camera


@c_struct("defrec_ransac_params")
class RansacParams(Struct):
    struct_size: U32
    landmarks: U32
    references: U32
    iterations: U32
    threshold_mm: F32
    min_support: U32
    seed: U64


@c_struct("defrec_lm_params")
class LmParams(Struct):
    struct_size: U32
    solver: U32
    nodes: U32
    edges: U32
    points: U32
    landmarks: U32
    patches: U32
    width: U32
    height: U32
    stride: U32
    camera: Camera
    iterations: U32
    cg_iterations: U32
    presolve: U32
    node_spacing_mm: F32
    icp_weight: F32
    match_weight: F32
    patch_weight: F32
    arap_weight: F32
    length_weight: F32
    angle_weight: F32
    rotation_weight: F32
    icp_tukey_mm: F32
    match_tukey_mm: F32
    patch_tukey_px: F32
    association_mm: F32
    damping: F32
    match_threshold_mm: F32


@c_struct("defrec_warp_params")
class WarpParams(Struct):
    struct_size: U32
    nodes: U32
    points: U32
    width: U32
    height: U32
    stride: U32
    reserved: U32
    camera: Camera
    tolerance_mm: F32


@c_struct("defrec_buffer")
class Buffer(Struct):
    data: Address
    size: U64


@c_struct("defrec_const_buffer")
class ConstBuffer(Struct):
    data: Address
    size: U64


# ---- tracking ----


@c_struct("defrec_tracker_desc")
class TrackerDesc(Struct):
    struct_size: U32
    flags: U32
    device_id: Text
    seed: U64
    format: U32
    frames_in_flight: U32
    disparities: U32
    min_disparity: I32
    min_depth_mm: F32
    node_spacing_px: F32
    vertex_spacing_px: F32
    max_features: U32
    max_patches: U32
    arap_weight: F32
    keep_disparity: U32
    coarse_iterations: U32
    fine_iterations: U32
    timed: U32
    memory_stride: U32


@c_struct("defrec_memory_desc")
class MemoryDesc(Struct):
    struct_size: U32
    kind: U32
    address: Address
    size: U64


@c_struct("defrec_frame")
class Frame(Struct):
    struct_size: U32
    flags: U32
    timestamp_ns: I64
    left: Address
    right: Address
    ignore: Address
    samples: Address


@c_struct("defrec_stage_time")
class StageTimeStruct(Struct):
    name: Text
    milliseconds: F64


StageTimes = Annotated[Any, StageTimeStruct * MAX_TIMED_STAGES]


@c_struct("defrec_result")
class ResultStruct(Struct):
    struct_size: U32
    state: U32
    reasons: U32
    epoch: U32
    timestamp_ns: I64
    frame: U64
    age: U32
    features: U32
    matches: U32
    inliers: U32
    patches: U32
    observed_share: F32
    mean_residual_mm: F32
    patch_residual_px: F32
    rigid_motion: F64x12
    motions: Address
    node_positions: Address
    node_count: U64
    vertices: Address
    normals: Address
    vertex_status: Address
    expected_error_mm: Address
    vertex_count: U64
    landmarks: Address
    landmark_matches: Address
    landmark_count: U64
    patch_observations: Address
    patch_count: U64
    disparity: Address
    times: StageTimes
    time_count: U32
    reserved: U32


@c_struct("defrec_template_info")
class TemplateInfo(Struct):
    struct_size: U32
    width: U32
    height: U32
    reserved: U32
    camera: Camera
    vertices: Address
    vertex_count: U64
    triangles: Address
    triangle_count: U64
    nodes: Address
    node_count: U64
    edges: Address
    edge_count: U64
    landmarks: Address
    landmark_count: U64
    patches: Address
    patch_count: U64
    image: Address
