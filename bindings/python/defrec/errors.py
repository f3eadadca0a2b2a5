"""What the package raises when the library refuses."""
from __future__ import annotations

from .enums import Status


class Error(Exception):
    """A call of libdefrec failed. str() is the library's error message: what was given, what was
    expected."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(status, message)
        self.status = status
        self.message = message

    def __str__(self) -> str:
        return f"{self.message} (DEFREC_{self.status.name})"


class BusyError(Error):
    """The queue is full, or another thread is inside this object: the one failure that a live loop
    meets every day."""


class DefrecWarning(UserWarning):
    """What defrec.track() warns of: what the library logs as a warning or an error, and points that
    cannot be followed."""


def closed(what: str) -> Error:
    return Error(Status.ERROR_HANDLE, f"this {what} is closed")
