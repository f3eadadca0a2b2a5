"""How the rows of a video's images follow each other in time."""
from __future__ import annotations

import ctypes
from contextlib import ExitStack, closing

from . import structs
from ._arrays import BufferLike, bytes_per_pixel, image
from ._library import native
from .enums import Format, Scan


def detect_scan(
    earlier: BufferLike,
    later: BufferLike,
    width: int,
    height: int,
    format: Format = Format.BGR8,
) -> Scan:
    """Tells from two consecutive images of one view how the rows of their video follow each other
    in time. A cut between them may deceive it, so ask about several pairs.

    earlier, later: uint8 images, (height, width, channels), gray (height, width), or bytes without
        gaps.

    threads: any. Raises TypeError and ValueError for images of another type or shape, and for
    an unknown format.
    """
    scan, channels = ctypes.c_uint32(), bytes_per_pixel(format)
    with ExitStack() as views:
        images = []
        for name, value in (("earlier", earlier), ("later", later)):
            made = structs.Image(format=format, width=width, height=height)
            view, made.stride = image(name, value, width, height, channels)
            views.enter_context(closing(view))
            made.pixels = view.address
            images.append(made)
        native.defrec_detect_scan(images[0], images[1], ctypes.byref(scan))
    return Scan(scan.value)
