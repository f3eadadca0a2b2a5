"""Finds libdefrec, checks its version, and declares its functions: native.defrec_job_wait(...) and so on.

A function that answers a status raises Error for a negative one. ctypes gives the GIL back during each call.
"""
from __future__ import annotations

import ctypes
import os
from ctypes import c_char_p, c_double, c_int32, c_size_t, c_uint32, c_uint64, c_uint8, c_void_p
from typing import Any, Dict, Optional, Sequence, Tuple, Type

from . import structs
from .enums import Status
from .errors import BusyError, Error

API_MAJOR = 1
API_MINOR = 1
"""The version of defrec_c.h that this package is written for."""

FILE_NAME = f"libdefrec.so.{API_MAJOR}"

LogFunction = ctypes.CFUNCTYPE(None, c_void_p, c_int32, c_char_p, c_char_p)


class StatusResult(c_int32):
    """The result type of functions that answer a status."""


def _pointer(struct: Type[structs.Struct]) -> Any:
    return ctypes.POINTER(struct)


_handle_out = ctypes.POINTER(c_void_p)
_doubles = c_void_p  # addresses: an array's, whoever made it
_bytes = c_void_p

# Result and parameters of each function, in the header's order.
PROTOTYPES: Dict[str, Tuple[Any, Sequence[Any]]] = {
    "defrec_version": (c_uint32, []),
    "defrec_version_string": (c_char_p, []),
    "defrec_status_name": (c_char_p, [c_int32]),
    "defrec_last_error": (c_char_p, []),
    "defrec_context_create": (StatusResult, [_pointer(structs.ContextDesc), _handle_out]),
    "defrec_context_destroy": (None, [c_void_p]),
    "defrec_plugin_count": (c_size_t, [c_void_p]),
    "defrec_plugin_get": (StatusResult, [c_void_p, c_size_t, _pointer(structs.PluginInfoStruct)]),
    "defrec_device_count": (c_size_t, [c_void_p]),
    "defrec_device_get": (StatusResult, [c_void_p, c_size_t, _pointer(structs.DeviceInfoStruct)]),
    "defrec_rig_create": (StatusResult, [c_void_p, _pointer(structs.RigDesc), _handle_out]),
    "defrec_rig_destroy": (None, [c_void_p]),
    "defrec_rig_get": (StatusResult, [c_void_p, _pointer(structs.RigInfo)]),
    "defrec_rig_rectify_pixels": (StatusResult, [c_void_p, _doubles, c_size_t, _doubles]),
    "defrec_rig_distort_pixels": (StatusResult, [c_void_p, _doubles, c_size_t, _doubles]),
    "defrec_stage_create": (StatusResult, [c_void_p, c_char_p, c_uint32, c_void_p, _handle_out]),
    "defrec_stage_destroy": (None, [c_void_p]),
    "defrec_stage_prepare": (StatusResult, [c_void_p, _pointer(structs.ConstBuffer), c_size_t]),
    "defrec_stage_run": (
        StatusResult,
        [c_void_p, _pointer(structs.ConstBuffer), c_size_t, _pointer(structs.Buffer), c_size_t],
    ),
    "defrec_tracker_create": (StatusResult, [c_void_p, c_void_p, _pointer(structs.TrackerDesc), _handle_out]),
    "defrec_tracker_destroy": (None, [c_void_p]),
    "defrec_memory_import": (StatusResult, [c_void_p, _pointer(structs.MemoryDesc), _handle_out]),
    "defrec_memory_release": (None, [c_void_p]),
    "defrec_tracker_submit": (StatusResult, [c_void_p, _pointer(structs.Frame), _handle_out]),
    "defrec_job_wait": (StatusResult, [c_void_p, c_uint64]),
    "defrec_job_release": (None, [c_void_p]),
    "defrec_job_result": (StatusResult, [c_void_p, _pointer(structs.ResultStruct)]),
    "defrec_job_warp_points": (StatusResult, [c_void_p, _doubles, c_size_t, _doubles, _bytes, _doubles]),
    "defrec_tracker_get_template": (StatusResult, [c_void_p, _handle_out]),
    "defrec_tracker_set_template": (StatusResult, [c_void_p, c_void_p]),
    "defrec_template_release": (None, [c_void_p]),
    "defrec_template_get": (StatusResult, [c_void_p, _pointer(structs.TemplateInfo)]),
    "defrec_template_lift": (StatusResult, [c_void_p, _doubles, c_size_t, _doubles, _bytes]),
    "defrec_template_save": (StatusResult, [c_void_p, c_char_p]),
    "defrec_template_load": (StatusResult, [c_void_p, c_char_p, _handle_out]),
}


def _open() -> Tuple[ctypes.CDLL, str]:
    """The library in the package (a wheel's), else the one that the system's loader finds; never one in the working
    directory."""
    bundled = os.path.join(os.path.dirname(os.path.abspath(__file__)), "lib", FILE_NAME)
    is_bundled = os.path.exists(bundled)
    name = bundled if is_bundled else FILE_NAME
    try:
        return ctypes.CDLL(name), name
    except OSError as error:
        advice = (
            "It came with this package: it is damaged, or the system lacks a library that it needs."
            if is_bundled
            else "Install the package libdefrec1, or the wheel, or name the library's folder in LD_LIBRARY_PATH."
        )
        raise ImportError(f"{name} cannot be loaded: {error}. {advice}") from None


def _check_version(library: ctypes.CDLL, name: str) -> None:
    try:
        library.defrec_version.restype = c_uint32
        major, minor = divmod(library.defrec_version(), 1000)
    except AttributeError:
        raise ImportError(f"{name} is not a libdefrec: it has no function defrec_version") from None
    if major != API_MAJOR or minor < API_MINOR:
        raise ImportError(
            f"{name} has version {major}.{minor} of the C API; "
            f"this package needs {API_MAJOR}.{API_MINOR} or a later {API_MAJOR}.x"
        )


def _raise_failure(result: StatusResult, function: Any, arguments: Any) -> Status:
    status = result.value
    if status >= 0:
        return Status(status)
    sentence = text(native.defrec_last_error())
    raise (BusyError if status == Status.ERROR_BUSY else Error)(Status(status), sentence)


def _declare(library: ctypes.CDLL) -> None:
    for name, (result, parameters) in PROTOTYPES.items():
        function = getattr(library, name)
        function.restype = result
        function.argtypes = list(parameters)
        if result is StatusResult:
            function.errcheck = _raise_failure


def text(value: Optional[bytes]) -> str:
    return "" if value is None else value.decode("utf-8", "replace")


def c_text(name: str, value: Any) -> bytes:
    """An identifier as the C API takes it."""
    if not isinstance(value, str):
        raise TypeError(f"{name} is a text, {value!r} given")
    return _without_nul(name, value.encode("utf-8"))


def c_path(name: str, value: Any) -> bytes:
    try:
        return _without_nul(name, os.fsencode(value))
    except TypeError:
        raise TypeError(f"{name} is a path, {value!r} given") from None


def _without_nul(name: str, value: bytes) -> bytes:
    if b"\0" in value:
        raise ValueError(f"{name} has a NUL character in it")
    return value


native, path = _open()
_check_version(native, path)
_declare(native)
