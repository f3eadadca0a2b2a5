"""Finds libdefrec, checks its version, and declares its functions: native.defrec_job_wait(...) and
so on.

A function that answers a status raises Error for a negative one. ctypes gives the GIL back during
each call.
"""
from __future__ import annotations

import ctypes
import os
import time
from ctypes import c_char_p, c_int32, c_uint32, c_void_p
from typing import Any, Callable, Optional, Tuple

from ._prototypes import API_MAJOR, API_MINOR, PROTOTYPES
from ._struct import StatusResult
from .enums import Status
from .errors import BusyError, Error

FILE_NAME = f"libdefrec.so.{API_MAJOR}"

LogFunction = ctypes.CFUNCTYPE(None, c_void_p, c_int32, c_char_p, c_char_p)


def _open() -> Tuple[ctypes.CDLL, str]:
    """The library in the package (a wheel's), else the one that the system's loader finds; never
    one in the working directory."""
    bundled = os.path.join(os.path.dirname(os.path.abspath(__file__)), "lib", FILE_NAME)
    is_bundled = os.path.exists(bundled)
    name = bundled if is_bundled else FILE_NAME
    try:
        return ctypes.CDLL(name), name
    except OSError as error:
        advice = (
            "It came with this package: it is damaged, or the system lacks a library that it needs."
            if is_bundled
            else (
                "Install the package libdefrec1, or the wheel, or name the library's folder in"
                " LD_LIBRARY_PATH."
            )
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
    message = text(native.defrec_last_error())
    raise (BusyError if status == Status.ERROR_BUSY else Error)(Status(status), message)


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


_FOR_EVER = (1 << 64) - 1


def nanoseconds(timeout: Optional[float]) -> int:
    """How long to wait, as the C API takes it; None: for ever."""
    if timeout is None:
        return _FOR_EVER
    if not timeout >= 0:
        raise ValueError(f"timeout is {timeout}, seconds of at least 0 expected")
    return int(min(timeout * 1e9, _FOR_EVER)) if timeout < _FOR_EVER else _FOR_EVER


_SLICE = 100_000_000  # ns


def wait_in_slices(wait: Callable[[int], Any], timeout: Optional[float]) -> bool:
    """Whether wait(nanoseconds) ended in time. Between slices Python takes signals, so that Ctrl-C
    ends a wait for a device that hangs."""
    left = nanoseconds(timeout)
    end = time.monotonic_ns() + left
    while wait(min(left, _SLICE)) == Status.TIMEOUT:
        left = end - time.monotonic_ns()
        if left <= 0:
            return False
    return True


native, path = _open()
_check_version(native, path)
_declare(native)
