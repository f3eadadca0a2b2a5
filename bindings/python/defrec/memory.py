"""Memory that a tracker's device works in, instead of copies: docs/api/device_memory.md."""
from __future__ import annotations

from typing import Any, Sequence, Tuple

from . import structs
from ._arrays import BufferView
from ._handle import Handle
from .enums import MemoryKind


class Memory(Handle):
    """Made by Tracker.import_memory, for frames of that tracker. Frames that were submitted with it
    are computed even after close()."""


def memory_desc(source: Any) -> Tuple[structs.MemoryDesc, Any]:
    """What to import, and what has to stay alive meanwhile."""
    cuda = getattr(source, "__cuda_array_interface__", None)
    if cuda is not None:
        item_size = int(cuda["typestr"][2:])
        size = _extent(tuple(cuda["shape"]), cuda.get("strides"), item_size)
        return structs.MemoryDesc(kind=MemoryKind.CUDA, address=cuda["data"][0], size=size), source
    view = BufferView("source", source, writable=True)
    size = _extent(view.shape, view.strides, view.item_size)
    return structs.MemoryDesc(kind=MemoryKind.HOST, address=view.address, size=size), view


def _extent(shape: Sequence[int], strides: Any, item_size: int) -> int:
    """Bytes from the first element's beginning to the last one's end."""
    if 0 in shape:
        return 0
    if strides is None:
        size = item_size
        for length in shape:
            size *= length
        return size
    if any(stride < 0 for stride in strides):
        raise ValueError(
            "source runs backwards in memory; its first element has to be the first in memory"
        )
    gaps: int = sum((length - 1) * stride for length, stride in zip(shape, strides))
    return gaps + item_size
