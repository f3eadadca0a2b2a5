"""What the generated structs, enumerations and prototypes are made of."""
from __future__ import annotations

import ctypes
import operator
from enum import IntEnum
from typing import Annotated, Any, Callable, Dict, Optional, Type, TypeVar, get_type_hints

I16 = Annotated[int, ctypes.c_int16]
U16 = Annotated[int, ctypes.c_uint16]
I32 = Annotated[int, ctypes.c_int32]
U32 = Annotated[int, ctypes.c_uint32]
I64 = Annotated[int, ctypes.c_int64]
U64 = Annotated[int, ctypes.c_uint64]
Size = Annotated[int, ctypes.c_size_t]
F32 = Annotated[float, ctypes.c_float]
F64 = Annotated[float, ctypes.c_double]
Address = Annotated[Any, ctypes.c_void_p]
Text = Annotated[Any, ctypes.c_char_p]


def c_type(annotated: Any) -> Any:
    """The C type of U32 and the others above."""
    return annotated.__metadata__[0]


class StatusResult(ctypes.c_int32):
    """The result type of functions that answer a status."""


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


def fitting(name: str, value: Any, c_type: Any) -> int:
    """The integer, if it is one that fits the C type; ctypes would cut it."""
    try:
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} is an integer, {value!r} given") from None
    bits = 8 * ctypes.sizeof(c_type)
    least, most = (
        (-(1 << bits - 1), (1 << bits - 1) - 1) if c_type._type_.islower() else (0, (1 << bits) - 1)
    )
    if not least <= number <= most:
        raise ValueError(f"{name} is {number}, {least} to {most} expected")
    return number


class Struct(ctypes.Structure):
    """Refuses names that are no field and numbers that do not fit their field, which ctypes would
    take."""

    _c_types_: Dict[str, Any] = {}
    _defaults_: Dict[str, float] = {}
    """Defaults of parameters and options: what 0 means, where that is a number."""

    def __init__(self, **fields: Any) -> None:
        super().__init__()
        if "struct_size" in self._c_types_:
            self.struct_size = ctypes.sizeof(self)
        for name, value in fields.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        if name not in self._c_types_:
            raise AttributeError(f"{type(self).__name__} has no field {name}")
        code = getattr(self._c_types_[name], "_type_", None)
        if isinstance(code, str) and (code in "hHiIlLqQ" or code == "P" and isinstance(value, int)):
            value = fitting(f"{type(self).__name__}.{name}", value, self._c_types_[name])
        elif isinstance(code, str) and code in "fd":
            try:
                value = float(value)
            except (TypeError, ValueError, OverflowError):
                raise TypeError(
                    f"{type(self).__name__}.{name} is a number, {value!r} given"
                ) from None
        super().__setattr__(name, value)

    def __repr__(self) -> str:
        shown = []
        for name in self._c_types_:
            value = getattr(self, name)
            if name != "struct_size" and not name.startswith("reserved"):
                shown.append(
                    f"{name}={list(value) if isinstance(value, ctypes.Array) else value!r}"
                )
        return f"{type(self).__name__}({', '.join(shown)})"

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return False
        return bytes(self) == bytes(other)  # type: ignore[no-any-return, call-overload]

    __hash__ = None  # type: ignore[assignment]


C_STRUCTS: Dict[str, Type[Struct]] = {}
"""Every struct by its name in the header."""

S = TypeVar("S", bound=Type[Struct])


def c_struct(name: str, **defaults: float) -> Callable[[S], S]:
    """Makes a class's annotations its C fields, in their order."""

    def declare(cls: S) -> S:
        hints = get_type_hints(cls, include_extras=True)
        fields = []
        for field in cls.__dict__["__annotations__"]:
            hint = hints[field]
            fields.append((field, hint.__metadata__[0] if hasattr(hint, "__metadata__") else hint))
        cls._fields_ = fields
        cls._c_types_ = dict(fields)
        cls._defaults_ = defaults
        C_STRUCTS[name] = cls
        return cls

    return declare
