"""Arrays in and out of the library, with NumPy where it is installed and with memoryview and ctypes
arrays where it is not.

Everything that comes in is checked for its type, shape and size before the library sees its
address.
"""
from __future__ import annotations

import array
import ctypes
import functools
import math
import re
from ctypes import POINTER, byref, c_char_p, c_int, c_ssize_t, c_void_p, py_object
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple, Type, Union

from .enums import Format
from ._struct import Struct, fitting

numpy: Any
try:
    import numpy
except ImportError:
    numpy = None

# By names of their own: `numpy` above is a variable, whose members type checkers do not know.
if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]
    Float32Array = npt.NDArray[np.float32]
    ByteArray = npt.NDArray[np.uint8]
    BoolArray = npt.NDArray[np.bool_]
    DisparityArray = npt.NDArray[np.int16]
    IndexArray = npt.NDArray[np.uint32]
    RecordArray = npt.NDArray[np.void]
    ArrayLike = Union[npt.ArrayLike, memoryview]
    BufferLike = Union[
        npt.NDArray[Any], bytes, bytearray, memoryview, "ctypes.Array[Any]", ctypes.Structure
    ]
else:
    FloatArray = Float32Array = ByteArray = BoolArray = Any
    DisparityArray = IndexArray = RecordArray = Any
    ArrayLike = Any
    """Numbers in rows: a NumPy array, nested sequences, a memoryview."""
    BufferLike = Any
    """What has the buffer protocol: a NumPy array, bytes, bytearray, memoryview, a ctypes
    array."""

# Type codes as the struct module and NumPy have them.
_C_TYPES: Dict[str, Any] = {
    "d": ctypes.c_double,
    "f": ctypes.c_float,
    "B": ctypes.c_uint8,
    "?": ctypes.c_bool,
    "h": ctypes.c_int16,
    "i": ctypes.c_int32,
    "I": ctypes.c_uint32,
}
_INTEGERS = "BI"  # those that Points takes
_NAMES = {
    "d": "float64",
    "f": "float32",
    "B": "uint8",
    "?": "bool",
    "h": "int16",
    "i": "int32",
    "I": "uint32",
}

BYTES_PER_PIXEL = {Format.GRAY8: 1, Format.BGR8: 3, Format.RGB8: 3, Format.BGRA8: 4}


def bytes_per_pixel(format: Any) -> int:
    """As BYTES_PER_PIXEL has them. Raises ValueError for what is no Format."""
    if format not in BYTES_PER_PIXEL:
        raise ValueError(f"format is {format!r}, a Format expected")
    return BYTES_PER_PIXEL[format]


Element = Union[str, Type[Struct]]


class _PyBuffer(ctypes.Structure):
    _fields_ = [
        ("buf", c_void_p),
        ("obj", c_void_p),
        ("len", c_ssize_t),
        ("itemsize", c_ssize_t),
        ("readonly", c_int),
        ("ndim", c_int),
        ("format", c_char_p),
        ("shape", POINTER(c_ssize_t)),
        ("strides", POINTER(c_ssize_t)),
        ("suboffsets", POINTER(c_ssize_t)),
        ("internal", c_void_p),
    ]


_get_buffer = ctypes.pythonapi.PyObject_GetBuffer
_get_buffer.argtypes = [py_object, POINTER(_PyBuffer), c_int]
_release_buffer = ctypes.pythonapi.PyBuffer_Release
_release_buffer.argtypes = [POINTER(_PyBuffer)]
_release_buffer.restype = None

_STRIDES_AND_FORMAT = 0x1C
_WRITABLE = 0x01


def refuse_mask(name: str, value: Any) -> None:
    """A mask would be lost: what it hides would be taken for numbers."""
    if numpy is not None and isinstance(value, numpy.ma.MaskedArray):
        raise TypeError(
            f"{name} is a masked array, whose mask is not taken: give {name}.filled(...) or"
            f" {name}.data"
        )


class BufferView:
    """Someone else's memory, which stays in place until close(): address, shape, strides (bytes),
    type code."""

    def __init__(self, name: str, value: BufferLike, writable: bool = False) -> None:
        refuse_mask(name, value)
        self.name = name
        self._buffer: Optional[_PyBuffer] = None
        buffer = _PyBuffer()
        try:
            _get_buffer(value, byref(buffer), _STRIDES_AND_FORMAT | (_WRITABLE if writable else 0))
        except (BufferError, TypeError, ValueError) as error:
            kind = "a writable array or buffer" if writable else "an array or buffer"
            raise TypeError(
                f"{name}: {kind} expected, {type(value).__name__} given ({error})"
            ) from None
        self._buffer = buffer
        self.address: int = buffer.buf or 0
        self.size: int = buffer.len
        self.item_size: int = buffer.itemsize
        self.shape: Tuple[int, ...] = tuple(buffer.shape[i] for i in range(buffer.ndim))
        self.strides: Tuple[int, ...] = self._without_gaps()
        if buffer.strides:
            self.strides = tuple(buffer.strides[i] for i in range(buffer.ndim))
        layout = (buffer.format or b"B").decode("utf-8", "replace")
        # A field's name stands between colons. The library would write bytes where Python's
        # references are.
        if "O" in re.sub(":[^:]*:", "", layout):
            raise TypeError(f"{name} has elements that are Python objects, numbers expected")
        self.code: str = layout.lstrip("<=@|")

    def close(self) -> None:
        buffer, self._buffer = self._buffer, None
        if buffer is not None:
            _release_buffer(byref(buffer))

    __del__ = close

    def expect_code(self, codes: str) -> None:
        if self.code not in codes or self.code == "":
            expected = " or ".join(_NAMES[code] for code in codes)
            raise TypeError(
                f"{self.name} has elements of type {_NAMES.get(self.code, repr(self.code))},"
                f" {expected} expected"
            )

    def expect_contiguous(self) -> None:
        unlike = any(
            a != b for n, a, b in zip(self.shape, self.strides, self._without_gaps()) if n > 1
        )
        if unlike and self.size > 0:
            raise ValueError(
                f"{self.name} has gaps or another order in memory: give"
                f" numpy.ascontiguousarray({self.name})"
            )

    def _without_gaps(self) -> Tuple[int, ...]:
        return tuple(
            self.item_size * math.prod(self.shape[i + 1 :]) for i in range(len(self.shape))
        )


def image(
    name: str, value: BufferLike, width: int, height: int, channels: int, codes: str = "B"
) -> Tuple[BufferView, int]:
    """An image of that size where it lies, and its stride in bytes. Rows may have gaps between
    them, pixels not.

    The shape is (height, width), or (height, width, channels), or flat, height * width * channels
    bytes without gaps.
    """
    view = BufferView(name, value)
    view.expect_code(codes)
    row = width * channels
    if len(view.shape) == 1:
        view.expect_contiguous()
        if view.size != row * height:
            raise ValueError(
                f"{name} has {view.size} bytes, {width} x {height} pixels of {channels} bytes are"
                f" {row * height}"
            )
        return view, row
    shapes = [(height, width, channels)] + ([(height, width)] if channels == 1 else [])
    if view.shape not in shapes:
        raise ValueError(
            f"{name} has the shape {view.shape}, {shapes[-1]} expected "
            f"(height, width{', channels' if channels > 1 else ''})"
        )
    if view.strides[-1] != 1 or view.strides[1] != channels or view.strides[0] < row:
        raise ValueError(
            f"{name} has rows whose pixels do not lie one after the other: give"
            f" numpy.ascontiguousarray({name})"
        )
    return view, view.strides[0]


def check_image(
    name: str, value: BufferLike, width: int, height: int, channels: int, codes: str = "B"
) -> None:
    """As image(), without gaps between rows."""
    view, stride = image(name, value, width, height, channels, codes)
    view.close()
    if stride != width * channels:
        raise ValueError(f"{name} has gaps between its rows: give numpy.ascontiguousarray({name})")


def check_numbers(name: str, value: BufferLike, code: str, *shapes: Tuple[int, ...]) -> None:
    """Numbers of that type and one of the shapes, or flat and as many, without gaps."""
    view = BufferView(name, value)
    view.close()
    view.expect_code(code)
    view.expect_contiguous()
    if view.shape not in shapes and view.shape != (math.prod(shapes[0]),):
        raise ValueError(
            f"{name} has the shape {view.shape}, {' or '.join(map(str, shapes))} expected"
        )


def check_records(
    name: str,
    value: BufferLike,
    struct: Type[Struct],
    count: Optional[int] = None,
    most: Optional[int] = None,
) -> Tuple[BufferLike, int]:
    """Records and their number: a NumPy or ctypes array of them, their bytes, or a list, of which a
    ctypes array is made. count, most: how many are expected."""
    if isinstance(value, (list, tuple)):
        if not all(isinstance(record, struct) for record in value):
            raise TypeError(f"{name}: a list of {struct.__name__} expected")
        value = (struct * len(value))(*value)
    view = BufferView(name, value)
    view.close()
    view.expect_contiguous()
    size = ctypes.sizeof(struct)
    if view.size > 0 and (view.item_size not in (size, 1) or view.size % size != 0):
        raise TypeError(
            f"{name}: an array of {struct.__name__} expected, {size} bytes each; its elements have"
            f" {view.item_size}"
        )
    if count is not None and view.size != count * size:
        raise ValueError(f"{name} has {view.size // size} elements, {count} expected")
    if most is not None and view.size > most * size:
        raise ValueError(f"{name} has {view.size // size} elements, at most {most} expected")
    return value, view.size // size


class Points:
    """Rows of numbers of that type code without gaps: those given where that is what they are, else
    a copy. They stay where they are as long as this object lives."""

    def __init__(self, name: str, value: ArrayLike, columns: int, code: str = "d") -> None:
        refuse_mask(name, value)
        if numpy is not None:
            self._values = _numpy_rows(name, value, columns, code)
            self.count = len(self._values)
            self.address: int = self._values.ctypes.data
        else:
            self._values = _rows(name, value, columns, code)
            self.count = len(self._values) // columns
            self.address = ctypes.addressof(self._values)


def column(name: str, value: ArrayLike, code: str = "d") -> Points:
    """Numbers one after the other, as Points with one column."""
    refuse_mask(name, value)
    items: Any = value
    if numpy is not None:
        items = numpy.asarray(value)
        if items.ndim != 1:
            raise ValueError(f"{name} has the shape {items.shape}, (n,) expected")
        return Points(name, items.reshape(-1, 1), 1, code)
    try:
        rows: Any = [(item,) for item in items]
    except TypeError:
        raise TypeError(f"{name}: numbers expected, {value!r} given") from None
    return Points(name, rows, 1, code)


def _numpy_rows(name: str, value: ArrayLike, columns: int, code: str) -> Any:
    try:
        given = numpy.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    if given.ndim != 2 or given.shape[1] != columns:
        if given.size != 0 or given.ndim > 2:
            raise ValueError(f"{name} has the shape {given.shape}, (n, {columns}) expected")
        given = given.reshape(0, columns)
    if code in _INTEGERS and given.size == 0:
        given = given.astype(code)  # what is empty has any type
    if code in _INTEGERS and given.dtype.kind not in "iu":
        raise TypeError(f"{name} has elements of type {given.dtype}, integers expected")
    if code in _INTEGERS and given.size > 0:
        for number in (given.min(), given.max()):
            fitting(name, number, _C_TYPES[code])
    if not numpy.can_cast(given.dtype, numpy.float64, "same_kind"):
        raise TypeError(f"{name} has elements of type {given.dtype}, numbers expected")
    with numpy.errstate(over="ignore"):  # what float32 does not hold is infinite
        return numpy.require(given, numpy.dtype(code), ["C", "ALIGNED"])


def _rows(name: str, value: Any, columns: int, code: str) -> Any:
    if isinstance(value, memoryview):
        value = value.tolist()
    elif isinstance(value, array.array):
        raise ValueError(
            f"{name} is flat, rows of {columns} expected: "
            f"memoryview(a).cast('B').cast('{value.typecode}', (n, {columns}))"
        )
    try:
        rows = [
            tuple(number if code in _INTEGERS else float(number) for number in row) for row in value
        ]
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name}: rows of {columns} numbers expected") from None
    if code in _INTEGERS:
        rows = [tuple(fitting(name, number, _C_TYPES[code]) for number in row) for row in rows]
    if any(len(row) != columns for row in rows):
        raise ValueError(f"{name}: rows of {columns} numbers expected")
    return (_C_TYPES[code] * (columns * len(rows)))(*(number for row in rows for number in row))


def flat(name: str, value: ArrayLike, counts: Sequence[int]) -> List[float]:
    """The numbers in a small array or nested sequence, row by row; as many as one of counts
    says."""
    found: List[float] = []

    def collect(item: Any) -> None:
        refuse_mask(name, item)
        if hasattr(item, "tolist"):
            item = item.tolist()
        if isinstance(item, (list, tuple)):
            for each in item:
                collect(each)
        elif isinstance(item, (str, bytes)) or item is None:
            raise TypeError(f"{name}: numbers expected, {item!r} given")
        else:
            try:
                found.append(float(item))
            except (TypeError, ValueError, OverflowError):
                raise TypeError(f"{name}: numbers expected, {item!r} given") from None

    collect(value)
    if len(found) not in counts:
        expected = " or ".join(str(count) for count in counts)
        raise ValueError(f"{name} has {len(found)} numbers, {expected} expected")
    return found


def empty(element: Element, shape: Sequence[int]) -> Any:
    """A new array, zeros. Without NumPy: of records a ctypes array; of numbers a memoryview of that
    shape (where nothing is in it, of one dimension, since a memoryview knows no other)."""
    if numpy is not None:
        return numpy.zeros(tuple(shape), _dtype(element))
    count = math.prod(shape)
    if not isinstance(element, str):
        return (element * count)()
    view = memoryview(bytearray(max(count, 1) * _size_of(element)))
    return view.cast(element, tuple(shape)) if count > 0 else view.cast(element)[:0]


@functools.lru_cache(maxsize=None)
def _dtype(element: Element) -> Any:
    return numpy.dtype(element)


def address_of(made: Any) -> int:
    """Where an array made by empty() lies."""
    if numpy is not None:
        return made.ctypes.data  # type: ignore[no-any-return]
    if isinstance(made, memoryview):
        return BufferView("array", made).address
    return ctypes.addressof(made)


def copied(address: Optional[int], element: Element, shape: Sequence[int]) -> Any:
    """A new array with what lies at the address."""
    made = empty(element, shape)
    size = _size_of(element) * math.prod(shape)
    if size > 0 and address is not None:
        ctypes.memmove(address_of(made), address, size)
    return made


def _size_of(element: Element) -> int:
    return ctypes.sizeof(_C_TYPES[element]) if isinstance(element, str) else ctypes.sizeof(element)


def head(made: Any, count: int) -> Any:
    """A copy of an array's first elements."""
    if numpy is not None:
        return made[:count].copy()
    return (made._type_ * count).from_buffer_copy(made) if count > 0 else (made._type_ * 0)()
