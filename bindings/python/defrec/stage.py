"""One stage on one device, with any buffers. docs/stages.md says which ones, in which order and of
which sizes; stages.py has the stages with arrays instead."""
from __future__ import annotations

import ctypes
from contextlib import ExitStack, closing
from typing import Any, Dict, Optional, Sequence, Type

from . import structs
from ._arrays import BufferLike, BufferView
from ._handle import Handle
from ._library import c_text, native
from ._struct import Struct
from .context import Context
from .enums import StageKind

KIND_OF_PARAMS: Dict[Type[Struct], StageKind] = {
    getattr(structs, f"{kind.name.capitalize()}Params"): kind for kind in StageKind
}


class Stage(Handle):
    """The stage whose parameters are given (StereoParams: stereo). device_id None: the first device
    that offers it.

    threads: any, but prepare_buffers and run_buffers: one at a time (BusyError). Raises Error.
    """

    def __init__(self, context: Context, params: Struct, device_id: Optional[str] = None) -> None:
        if not isinstance(context, Context):
            raise TypeError(f"context is a Context, {context!r} given")
        kind = KIND_OF_PARAMS.get(type(params))
        if kind is None:
            raise TypeError(
                f"params: one of {', '.join(each.__name__ for each in KIND_OF_PARAMS)} expected,"
                f" {params!r} given"
            )
        device = None if device_id is None else c_text("device_id", device_id)
        handle, keep = context._open()
        super().__init__(
            lambda out: native.defrec_stage_create(
                handle, device, kind, ctypes.addressof(params), out
            ),
            native.defrec_stage_destroy,
            keep,
        )
        self.kind = kind

    def prepare_buffers(self, inputs: Sequence[Optional[BufferLike]]) -> None:
        """Gives the stage the inputs that stay the same from run to run (a template). A stage that
        has them needs it before its first run. threads: one"""
        with ExitStack() as views:
            c_inputs = _buffers("inputs", inputs, structs.ConstBuffer, views)
            native.defrec_stage_prepare(self._native, c_inputs, len(c_inputs))

    def run_buffers(
        self, inputs: Sequence[Optional[BufferLike]], outputs: Sequence[Optional[BufferLike]]
    ) -> None:
        """Runs the stage and waits; fills outputs, which are writable. None: an optional buffer
        that is not given. threads: one.

        A buffer that is too small raises Error, whose text names the size needed.
        """
        with ExitStack() as views:
            c_inputs = _buffers("inputs", inputs, structs.ConstBuffer, views)
            c_outputs = _buffers("outputs", outputs, structs.Buffer, views)
            native.defrec_stage_run(
                self._native, c_inputs, len(c_inputs), c_outputs, len(c_outputs)
            )


def _buffers(
    name: str, values: Sequence[Optional[BufferLike]], struct: Type[Struct], views: ExitStack
) -> Any:
    if isinstance(values, (str, bytes, bytearray, memoryview)) or not isinstance(values, Sequence):
        raise TypeError(f"{name}: a list of buffers expected, {type(values).__name__} given")
    made = (struct * len(values))()
    for index, value in enumerate(values):
        if value is not None:
            view = views.enter_context(
                closing(BufferView(f"{name}[{index}]", value, writable=struct is structs.Buffer))
            )
            view.expect_contiguous()
            made[index].data = view.address
            made[index].size = view.size
    return made
