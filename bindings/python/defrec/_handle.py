"""What every object of the library has in common: it is closed once, by close(), `with` or its collection, in any
order."""
from __future__ import annotations

import collections
import ctypes
import threading
import weakref
from typing import Any, Callable, Deque, Tuple, TypeVar

from .errors import closed

H = TypeVar("H", bound="Handle")

# A log callback may not call the library, which refuses even to destroy from there. But the collector may run in a
# callback, and find objects to close: they wait here for the next call that may.
_callback = threading.local()
_postponed: Deque[Tuple[Any, int, Any]] = collections.deque()


class CallbackScope:
    """With it: this thread is inside a callback of the library."""

    def __enter__(self) -> None:
        _callback.inside = True

    def __exit__(self, *exception: object) -> None:
        _callback.inside = False


def _destroy(function: Callable[[int], None], handle: int, keep: Any) -> None:
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
    """An object of the library. Use it in a `with` statement, or close() it; at the latest it is closed when it is
    collected.

    Objects may be closed in any order: what was made from an object keeps alive what it needs. After close() every use
    raises Error with Status.ERROR_HANDLE.
    """

    def __init__(self, handle: ctypes.c_void_p, destroy: Callable[[int], None], keep: Any = None) -> None:
        # keep: what has to live until the library has destroyed the handle. No docstring: help() would show it of every
        # class that has none at its constructor.
        assert handle.value is not None
        self._handle = handle.value
        self._keep = keep
        # Held while what the library points to is copied: it lives as long as the handle.
        self._copying = threading.Lock()
        self._close = weakref.finalize(self, _destroy, destroy, self._handle, keep)
        _destroy_postponed()

    @property
    def _native(self) -> int:
        if not self._close.alive:
            raise closed(type(self).__name__)
        return self._handle

    def _open(self) -> Tuple[int, Any]:
        """The handle, and what anything made from it has to keep alive. In this order, another thread's close() cannot
        come between."""
        keep = self._keep
        return self._native, keep

    @property
    def is_closed(self) -> bool:
        """Whether close() was called."""
        return not self._close.alive

    def close(self) -> None:
        """Gives the object back. Closing twice does nothing. threads: any"""
        with self._copying:
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
