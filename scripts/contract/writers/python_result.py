"""Python: Result, and how it is copied from what the library gives."""
from contract import PIXELS
from header import HeaderError
from names import enumeration_of_field, plural, sentence
from writers.python_binding import TOP, class_name, docstring, words

STEP = " " * 4

# Types of elements: type code, name and type of arrays as _arrays.py has them.
NUMBERS = {
    "double": ("d", "float64", "FloatArray"),
    "float": ("f", "float32", "Float32Array"),
    "uint8_t": ("B", "uint8", "ByteArray"),
    "int16_t": ("h", "int16", "DisparityArray"),
    "uint32_t": ("I", "uint32", "IndexArray"),
}

MODULE = '''\
import ctypes
from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

from . import structs
from ._arrays import {arrays}, RecordArray, copied
from ._library import text
from .enums import {enums}
from .structs import {records}

{tuples}
@dataclass(frozen=True)
class Result:
    """State, reasons and surface of one frame, copied. Lengths in mm; without a template the
    arrays are empty."""

{members}


def copy_result(r: structs.ResultStruct, size: Tuple[int, int]) -> Result:
    """size: of the rectified image, width and height."""
    width, height = size
    return Result(
{values}
    )
'''

TUPLE = """
class {name}(NamedTuple):
{summary}

{members}

"""


def record_name(struct):
    """The class that a record of the result becomes."""
    return class_name(struct).removesuffix("Struct")


def number(field):
    if field.element not in NUMBERS:
        where = f"{field.owner}.{field.name}"
        raise HeaderError(f"{where}: the Python package has no arrays of {field.element}")
    return NUMBERS[field.element]


def is_array(field):
    return bool(field.count) or field.leads_to_array


def rows(field):
    """The length of an array in words, and as an expression."""
    if field.counted_by is None:
        return [], []
    if field.counted_by == PIXELS:
        return ["height", "width"], ["height", "width"]
    return [plural(field.counted_by.removesuffix("_count"))], [f"r.{field.counted_by}"]


def tuple_of(parts):
    """As Python writes it."""
    return f"({', '.join(parts)}{',' if len(parts) == 1 else ''})"


def single_type(field):
    """The type of a field that is no array."""
    if field.is_text:
        return "str"
    kind = enumeration_of_field(field)
    return kind.python if kind else "float" if field.is_float else "int"


def field_type(contract, field):
    if not is_array(field):
        return single_type(field)
    if contract.holds_texts(field):
        return f"Tuple[{record_name(field.element)}, ...]"
    if field.element in contract.struct_of:
        return "RecordArray"
    kind = number(field)[2]
    return f"Optional[{kind}]" if field.counted_by == PIXELS else kind


def single_value(place, field):
    if field.is_text:
        return f"text({place})"
    kind = enumeration_of_field(field)
    return f"{kind.python}({place})" if kind else place


def value(contract, field):
    given = f"r.{field.name}"
    if not is_array(field):
        return single_value(given, field)
    if contract.holds_texts(field):
        members = contract.struct_of[field.element].fields
        copied = ", ".join(single_value(f"each.{member.name}", member) for member in members)
        made = f"{record_name(field.element)}({copied})"
        return f"tuple({made} for each in {given}[: r.{field.counted_by}])"
    is_record = field.element in contract.struct_of
    element = class_name(field.element) if is_record else f'"{number(field)[0]}"'
    shape = tuple_of([*rows(field)[1], *map(str, field.shape)])
    address = given if field.is_address else f"ctypes.addressof({given})"
    made = f"copied({address}, {element}, {shape})"
    return f"None if not {given} else {made}" if field.counted_by == PIXELS else made


def explained(contract, field):
    """The docstring, without what the type says."""
    text = words(field.words())
    if not is_array(field) or contract.holds_texts(field):
        kind = enumeration_of_field(field)
        return sentence(text.removeprefix(f"{kind.python}: ") if kind else text)
    is_record = field.element in contract.struct_of
    element = class_name(field.element) if is_record else number(field)[1]
    text = text[0].lower() + text[1:] if text[1].islower() else text
    shape = tuple_of([*rows(field)[0], *map(str, field.shape)])
    return f"{shape} {element}: {text.rstrip('.')}."


def members(contract, fields):
    lines = []
    for field in fields:
        lines.append(f"{STEP}{field.name}: {field_type(contract, field)}")
        lines += docstring(explained(contract, field), STEP)
    return "\n".join(lines)


def text_tuple(contract, struct):
    """Records with texts as tuples of Python."""
    summary = sentence(words(struct.summary.removesuffix(" Frozen.")))
    return TUPLE.format(
        name=record_name(struct.name),
        summary="\n".join(docstring(summary, STEP)),
        members=members(contract, struct.fields),
    )


def result(contract):
    lengths = contract.result.counts | contract.result.own_counts
    fields = [
        field for field in contract.result.fields if not (field.is_hidden or field.name in lengths)
    ]
    arrays = [field for field in fields if is_array(field)]
    with_texts = dict.fromkeys(field.element for field in arrays if contract.holds_texts(field))
    records = {field.element for field in arrays if field.element in contract.struct_of}
    kinds = [enumeration_of_field(field) for field in fields if not is_array(field)]
    top = TOP.format(what="What a frame gave; everything in it is a copy and outlives the job.")
    return top + MODULE.format(
        arrays=", ".join(sorted({number(f)[2] for f in arrays if f.element not in records})),
        enums=", ".join(sorted(kind.python for kind in set(kinds) - {None})),
        records=", ".join(sorted(class_name(name) for name in records - set(with_texts))),
        tuples="".join(text_tuple(contract, contract.struct_of[name]) for name in with_texts),
        members=members(contract, fields),
        values="\n".join(f"{STEP * 2}{f.name}={value(contract, f)}," for f in fields),
    )


def files(contract, root):
    return {"bindings/python/defrec/result.py": result(contract)}
