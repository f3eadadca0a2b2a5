"""The enumerations and limits of the C API: DEFREC_DEVICE_CPU is DeviceKind.CPU here.

A later library of the same major version may know more of them than this package; such a value is a member named
UNKNOWN_<value>.
"""
from __future__ import annotations

import operator
from enum import IntEnum, IntFlag
from typing import Optional

MIN_WIDTH = 64
MIN_HEIGHT = 48
MAX_SIDE = 8192
DISPARITY_ONE = 16
"""Disparities are int16 in 1/16 px."""
DISPARITY_NONE = -32768
"""No evidence at this pixel."""
ORB_ANGLE_BINS = 32
SKIN_NODES = 4
MAX_TIMED_STAGES = 16
STAGE_COUNT_V1 = 8


class OpenEnum(IntEnum):
    """Takes values that it does not know."""

    @classmethod
    def _missing_(cls, value: object) -> Optional["OpenEnum"]:
        try:
            number = operator.index(value)  # type: ignore[arg-type]
        except TypeError:
            return None
        member = int.__new__(cls, number)
        member._name_ = f"UNKNOWN_{number}"
        member._value_ = number
        return member


class Status(OpenEnum):
    """What a call answered; negative: failure."""

    OK = 0
    TIMEOUT = 1
    ERROR_ARGUMENT = -1
    ERROR_VERSION = -2
    ERROR_UNSUPPORTED = -3
    ERROR_OUT_OF_MEMORY = -4
    ERROR_DEVICE_LOST = -5
    ERROR_PLUGIN = -6
    ERROR_IO = -7
    ERROR_HANDLE = -8
    ERROR_BUSY = -9
    ERROR_STATE = -10
    ERROR_INTERNAL = -99


class LogLevel(OpenEnum):
    """How much a message of the log matters."""

    DEBUG = 1
    INFO = 2
    WARNING = 3
    ERROR = 4


class ContextFlag(IntFlag):
    """Flags of defrec_context_desc; Context takes them as keywords."""

    ONLY_GIVEN_PLUGINS = 1 << 0
    USE_ENVIRONMENT = 1 << 1


class DeviceKind(OpenEnum):
    """What kind of device computes."""

    CPU = 1
    CUDA = 2
    VULKAN = 3


class StageKind(OpenEnum):
    """The stages; docs/stages.md defines each."""

    RECTIFY = 0
    STEREO = 1
    ORB = 2
    MATCH = 3
    ALIGN = 4
    RANSAC = 5
    LM = 6
    WARP = 7


class DeviceFeature(IntFlag):
    """What holds of a device."""

    REPEATABLE = 1 << 0
    """The same input gives the same bits."""
    SOFTWARE = 1 << 1
    """A graphics driver that computes on the processor, slower than the CPU backend."""


class MemoryKind(OpenEnum):
    """Where memory lies that Tracker.import_memory_at() is given."""

    HOST = 1
    CUDA = 2


class Format(OpenEnum):
    """Of an image's pixels: bytes per pixel 1, 3, 3, 4."""

    GRAY8 = 1
    BGR8 = 2
    RGB8 = 3
    BGRA8 = 4


class Observation(OpenEnum):
    """What a frame says of a surface point."""

    OBSERVED = 0
    NO_DEPTH = 1
    OCCLUDED = 2
    OUTSIDE = 3
    INCONSISTENT = 4


class Solver(OpenEnum):
    """How stage lm solves for a step: over all control points, or each for itself."""

    COUPLED = 1
    INDEPENDENT = 2


class FrameFlag(IntFlag):
    """Flags of defrec_frame; Tracker.submit() takes them as keywords."""

    CAPTURE_TEMPLATE = 1 << 0


class State(OpenEnum):
    """State of a frame."""

    INITIALISING = 0
    """No template yet."""
    TRACKING = 1
    DEGRADED = 2
    """Followed, with less evidence than usual: see the reasons."""
    LOST = 3
    """Geometry is the last known and not to be believed."""
    RELOCALISED = 4
    """Found again in this frame; a new epoch."""


class Reason(IntFlag):
    """Why a frame is not simply tracked. The single reasons of a mask: [r for r in Reason if r in mask]."""

    DARK = 1 << 0
    SATURATED = 1 << 1
    NO_TEXTURE = 1 << 2
    FEW_MATCHES = 1 << 3
    OCCLUDED = 1 << 4
    LARGE_RESIDUAL = 1 << 5
    FAST_MOTION = 1 << 6
    OUT_OF_VIEW = 1 << 7
    NO_DEPTH = 1 << 8
    ONE_EYE = 1 << 9
    FROZEN = 1 << 10
    GAP = 1 << 11
    EYES_SWAPPED = 1 << 12
    LOW_CONTRAST = 1 << 13


class PointStatus(OpenEnum):
    """Status of a vertex or point."""

    OBSERVED = 0
    EXTRAPOLATED = 1
    """From its neighbourhood: occluded, outside or without depth."""
    UNKNOWN = 2
    """Not to be believed: the frame is lost, or nothing near it was seen."""
