"""defrec recovers, in real time, how a tissue surface deforms in stereo video.
docs/languages/python.md is the guide.

    for frame in defrec.track("left/", "right/", "calibration.yaml"):
        print(frame)                                    # state, points, expected error

and, with everything in one's own hands:

    with defrec.Context() as context:
        rig = defrec.Rig(context, 960, 540, M1, D1, M2, D2, R, T)
        tracker = defrec.Tracker(context, rig)
        # (left, right, timestamp_ns); images are uint8 arrays, BGR
        for job in tracker.process(frames):
            result = job.result()                       # state, reasons, surface, expected error
            if len(result.vertices) > 0:                # there is a template
                moved = job.warp_points(tumour_xyz)     # (n, 3), mm

Lengths are mm. Cameras: x right, y down, z forward. Pixel (0, 0) is the centre of the top-left
pixel. What fails in the library raises Error; what cannot be passed to it raises TypeError or
ValueError.
"""
from .body import BodyRegion, Mesh
from .calibration import Calibration
from .context import Context, DeviceInfo, PluginInfo, library_release, library_version, status_name
from .errors import BusyError, DefrecWarning, Error
from .hand_eye import HandEye, HandEyeResult
from .memory import Memory
from .plan import Plan, PlanData, PlanPart
from .points import FixedPoints, LiftedPoints, MovedTargets, PointCovariances, WarpedPoints
from .predictor import PredictedPoints, Predictor
from .registration import (
    AlternativePose,
    FreeMotion,
    RegisteredPoints,
    Registration,
    RegistrationResult,
)
from .result import Result, StageTime
from .rig import Rig
from .scan import detect_scan
from .stage import Stage
from .template import Lifted, Targets, Template, TemplateData
from .tracker import Job, Tracker
from .tracking import FollowedPoints, RigEstimate, TrackedFrame, Tracking, track

__version__ = library_release()

# By scripts/contract/generate.py: the names of the C API, and everything public.
from .enums import (
    BLEND_NODES,
    DISPARITY_NONE,
    DISPARITY_ONE,
    MAX_PREDICTION_MS,
    MAX_SIDE,
    MAX_TIMED_STAGES,
    MIN_HEIGHT,
    MIN_WIDTH,
    ORB_ANGLE_BINS,
    STAGE_COUNT_V1,
    TRACKER_FALLBACK,
    BodyMode,
    BodyState,
    ContextFlag,
    Deformation,
    DeviceFeature,
    DeviceKind,
    Evidence,
    Field,
    Format,
    Found,
    FrameFlag,
    FreeMotionKind,
    HandEyeFlag,
    LogLevel,
    MemoryKind,
    Observation,
    PlanFlag,
    PointStatus,
    PredictionBasis,
    Reason,
    RegionFlag,
    RegistrationFlag,
    Scan,
    SelfCalibration,
    Solver,
    StageKind,
    State,
    Status,
    Verdict,
    View,
)
from .stages import (
    AlignStage,
    LmStage,
    MatchStage,
    OrbStage,
    RansacStage,
    RectifyStage,
    StereoStage,
    WarpStage,
)
from .structs import (
    AlignParams,
    Camera,
    CutPoint,
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
    PatchSlope,
    Piece,
    RansacParams,
    RansacSummary,
    RectifyParams,
    StereoParams,
    SurfacePoint,
    SurfaceSample,
    WarpParams,
)

__all__ = [
    "BLEND_NODES",
    "DISPARITY_NONE",
    "DISPARITY_ONE",
    "MAX_PREDICTION_MS",
    "MAX_SIDE",
    "MAX_TIMED_STAGES",
    "MIN_HEIGHT",
    "MIN_WIDTH",
    "ORB_ANGLE_BINS",
    "STAGE_COUNT_V1",
    "TRACKER_FALLBACK",
    "AlignParams",
    "AlignStage",
    "AlternativePose",
    "BodyMode",
    "BodyRegion",
    "BodyState",
    "BusyError",
    "Calibration",
    "Camera",
    "Context",
    "ContextFlag",
    "CutPoint",
    "Deformation",
    "DefrecWarning",
    "DeviceFeature",
    "DeviceInfo",
    "DeviceKind",
    "Edge",
    "Error",
    "Evidence",
    "Feature",
    "Field",
    "FixedPoints",
    "FollowedPoints",
    "Format",
    "Found",
    "FrameFlag",
    "FreeMotion",
    "FreeMotionKind",
    "HandEye",
    "HandEyeFlag",
    "HandEyeResult",
    "Job",
    "Landmark",
    "Lifted",
    "LiftedPoints",
    "LmParams",
    "LmStage",
    "LmSummary",
    "LogLevel",
    "Match",
    "MatchParams",
    "MatchStage",
    "Memory",
    "MemoryKind",
    "Mesh",
    "Motion",
    "MovedTargets",
    "Observation",
    "OrbParams",
    "OrbStage",
    "Patch",
    "PatchObservation",
    "PatchPrediction",
    "PatchSlope",
    "Piece",
    "Plan",
    "PlanData",
    "PlanFlag",
    "PlanPart",
    "PluginInfo",
    "PointCovariances",
    "PointStatus",
    "PredictedPoints",
    "PredictionBasis",
    "Predictor",
    "RansacParams",
    "RansacStage",
    "RansacSummary",
    "Reason",
    "RectifyParams",
    "RectifyStage",
    "RegionFlag",
    "RegisteredPoints",
    "Registration",
    "RegistrationFlag",
    "RegistrationResult",
    "Result",
    "Rig",
    "RigEstimate",
    "Scan",
    "SelfCalibration",
    "Solver",
    "Stage",
    "StageKind",
    "StageTime",
    "State",
    "Status",
    "StereoParams",
    "StereoStage",
    "SurfacePoint",
    "SurfaceSample",
    "Targets",
    "Template",
    "TemplateData",
    "TrackedFrame",
    "Tracker",
    "Tracking",
    "Verdict",
    "View",
    "WarpParams",
    "WarpStage",
    "WarpedPoints",
    "detect_scan",
    "library_release",
    "library_version",
    "status_name",
    "track",
]
# End of what is generated.
