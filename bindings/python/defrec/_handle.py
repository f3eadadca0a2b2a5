"""What every object of the library has in common: it is closed once, by close(), `with` or its
collection, in any order."""
from __future__ import annotations

import collections
import contextlib
import ctypes
import threading
import weakref
from typing import Any, Callable, Deque, Iterator, Tuple, TypeVar

from .errors import closed

H = TypeVar("H", bound="Handle")

# A log callback may not call the library, which refuses even to destroy from there. But the
# collector may run in a callback, and find objects to close: they wait here for the next call that
# may.
_callback = threading.local()
_postponed: Deque[Tuple[Any, ctypes.c_void_p, Any]] = collections.deque()


class CallbackScope:
    """With it: this thread is inside a callback of the library."""

    def __enter__(self) -> None:
        _callback.inside = True

    def __exit__(self, *exception: object) -> None:
        _callback.inside = False


def _destroy(
    function: Callable[[ctypes.c_void_p], None], handle: ctypes.c_void_p, keep: Any
) -> None:
    if handle.value is None:  # its creation failed
        return
    if getattr(_callback, "inside", False):
        _postponed.append((function, handle, keep))
    else:
        _destroy_postponed()
        function(handle)


def _destroy_postponed() -> None:
    while _postponed:
        try:
            function, handle, _ = _postponed.popleft()
        except IndexError:  # another thread was quicker
            return
        function(handle)


class Handle:
    """An object of the library. Use it in a `with` statement, or close() it; at the latest it is
    closed when it is collected.

    Objects may be closed in any order: what was made from an object keeps alive what it needs.
    After close() every use raises Error with Status.ERROR_HANDLE.
    """

    def __init__(
        self,
        create: Callable[[ctypes.c_void_p], Any],
        destroy: Callable[[ctypes.c_void_p], None],
        keep: Any = None,
    ) -> None:
        # create: writes the new handle where it is told. keep: what has to live until the library
        # has destroyed it. No docstring: help() would show it of every class that has none at its
        # constructor.
        handle = ctypes.c_void_p()
        self._handle = handle
        self._keep = keep
        self._lock = threading.RLock()
        self._copies = 0
        self._close_wanted = False
        # Before there is a handle: a signal handler's exception (KeyboardInterrupt) may come right
        # behind its creation.
        self._close = weakref.finalize(self, _destroy, destroy, handle, keep)
        create(handle)
        _destroy_postponed()

    @property
    def _native(self) -> int:
        handle = self._handle.value
        if handle is None or not self._close.alive:
            raise closed(type(self).__name__)
        return handle

    @contextlib.contextmanager
    def _copying(self) -> Iterator[int]:
        """With it: what the library points to stays, since the handle does. Another thread's
        close() waits; one of this thread, from a signal handler or a finaliser in the middle of the
        copy, takes effect behind it."""
        with self._lock:
            self._copies += 1
            try:
                yield self._native
            finally:
                self._copies -= 1
                if self._copies == 0 and self._close_wanted:
                    self.close()

    def _open(self) -> Tuple[int, Any]:
        """The handle, and what anything made from it has to keep alive. In this order, another
        thread's close() cannot come between."""
        keep = self._keep
        return self._native, keep

    @property
    def is_closed(self) -> bool:
        """Whether close() was called."""
        return not self._close.alive

    def close(self) -> None:
        """Gives the object back. Closing twice does nothing. threads: any"""
        with self._lock:
            self._close_wanted = self._copies > 0
            if self._close_wanted:
                return
            self._close()
        self._keep = None

    def __enter__(self: H) -> H:
        self._native
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def __copy__(self) -> Any:
        raise TypeError(f"a {type(self).__name__} cannot be copied")

    def __deepcopy__(self, memo: Any) -> Any:
        self.__copy__()

    def __reduce__(self) -> Any:
        raise TypeError(f"a {type(self).__name__} cannot be pickled")
