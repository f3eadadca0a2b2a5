"""The library itself, and contexts: which plugins and devices there are."""
from __future__ import annotations

import ctypes
import os
from dataclasses import dataclass
from typing import Any, Callable, FrozenSet, Iterable, Optional, Tuple, Union

from . import structs
from ._handle import CallbackScope, Handle
from ._library import LogFunction, c_path, native, text
from ._struct import fitting
from .enums import ContextFlag, DeviceFeature, DeviceKind, LogLevel, StageKind, Status

Log = Callable[[LogLevel, str, str], None]


def library_version() -> Tuple[int, int]:
    """Major and minor version of the C API of the library in use. threads: any"""
    major, minor = divmod(native.defrec_version(), 1000)
    return major, minor


def library_release() -> str:
    """The library's release, for people: "0.1.0". threads: any"""
    return text(native.defrec_version_string())


def status_name(status: Union[Status, int]) -> str:
    """The name of a status in the C API: "DEFREC_ERROR_ARGUMENT"; "unknown status" for others.
    threads: any"""
    return text(native.defrec_status_name(fitting("status", status, ctypes.c_int32)))


@dataclass(frozen=True)
class PluginInfo:
    """One candidate that the search looked at."""

    name: str
    path: str
    version: str
    verdict: Status
    """OK when loaded, else why it was refused."""
    reason: str
    """Why it was refused, an error message; when loaded, which of its devices are left out and
    why."""


@dataclass(frozen=True)
class DeviceInfo:
    """What a tracker or a stage can compute on."""

    id: str
    """Stable and unique: "cpu", "reference", "cuda:GPU-1a2b"."""
    name: str
    kind: DeviceKind
    driver: str
    """Empty where there is none."""
    memory_bytes: int
    stages: FrozenSet[StageKind]
    features: DeviceFeature
    conformance: int
    """Version of the conformance suite passed, 0 if none."""


class Context(Handle):
    """Finds and loads the plugins. Succeeds with none found: look at devices.

    plugin_paths: absolute folders or manifest files, searched first.
    only_given_plugins: look nowhere but there. use_environment: honour DEFREC_PLUGIN_PATH (never
        when privileged).
    log(level, source, text): called from any thread, must not call defrec; level is a LogLevel,
        source "sdk" or a plugin's name. It lives as long as something made from this context does;
        one that refers to the context itself keeps it until close(). An exception in it goes to
        sys.unraisablehook.
    log_level: the lowest level reported. threads: of the library's own pool, 0: one per core.
    plugin_deadline_ms: how long a plugin may take to start, to return from a call or to do a
        frame's work, 0: a minute; then its device is quarantined.

    The C API's alloc and parallel_for are left out: they are called for every buffer and loop from
    threads that compute, which would wait for Python's lock each time.

    threads: any. Raises Error.
    """

    def __init__(
        self,
        plugin_paths: Iterable[Union[str, "os.PathLike[str]"]] = (),
        *,
        only_given_plugins: bool = False,
        use_environment: bool = False,
        log: Optional[Log] = None,
        log_level: LogLevel = LogLevel.INFO,
        threads: int = 0,
        plugin_deadline_ms: int = 0,
    ) -> None:
        if isinstance(plugin_paths, (str, bytes)):
            raise TypeError("plugin_paths is a list of paths, one text given")
        paths = [c_path("plugin_paths", path) for path in plugin_paths]
        if log is not None and not callable(log):
            raise TypeError(f"log is a function, {log!r} given")
        desc = structs.ContextDesc(
            log_level=log_level,
            threads=threads,
            plugin_path_count=len(paths),
            plugin_deadline_ms=plugin_deadline_ms,
        )
        desc.flags = (ContextFlag.ONLY_GIVEN_PLUGINS if only_given_plugins else 0) | (
            ContextFlag.USE_ENVIRONMENT if use_environment else 0
        )
        c_paths = (ctypes.c_char_p * len(paths))(*paths)
        if paths:
            desc.plugin_paths = ctypes.addressof(c_paths)
        c_log = None if log is None else _c_log(log)
        if c_log is not None:
            desc.log = ctypes.cast(c_log, ctypes.c_void_p)
        super().__init__(
            lambda handle: native.defrec_context_create(desc, handle),
            native.defrec_context_destroy,
            c_log,
        )

    @property
    def plugins(self) -> Tuple[PluginInfo, ...]:
        """Every candidate that was looked at, loaded or refused, in the order of the search.
        threads: any"""
        found = []
        with self._copying() as handle:
            for index in range(native.defrec_plugin_count(handle)):
                info = structs.PluginInfoStruct()
                native.defrec_plugin_get(handle, index, info)
                found.append(
                    PluginInfo(
                        text(info.name),
                        text(info.path),
                        text(info.version),
                        Status(info.verdict),
                        text(info.reason),
                    )
                )
        return tuple(found)

    @property
    def devices(self) -> Tuple[DeviceInfo, ...]:
        """Devices of all loaded plugins, fastest kind first, then by id: the same order in every
        run. threads: any"""
        found = []
        with self._copying() as handle:
            for index in range(native.defrec_device_count(handle)):
                info = structs.DeviceInfoStruct()
                native.defrec_device_get(handle, index, info)
                stages = frozenset(StageKind(bit) for bit in range(32) if info.stages >> bit & 1)
                found.append(
                    DeviceInfo(
                        text(info.id),
                        text(info.name),
                        DeviceKind(info.kind),
                        text(info.driver),
                        info.memory_bytes,
                        stages,
                        DeviceFeature(info.features),
                        info.conformance,
                    )
                )
        return tuple(found)


def _c_log(log: Log) -> Any:
    def call(user: Optional[int], level: int, source: bytes, message: bytes) -> None:
        with CallbackScope():
            log(LogLevel(level), text(source), text(message))

    return LogFunction(call)
