"""The stub libdefrec (bindings/stub): what was called, and what calls answer."""
import ctypes
import re
import unittest

from defrec import _library

_library.native.defrec_stub_calls.restype = ctypes.c_char_p
_library.native.defrec_stub_answer.argtypes = [ctypes.c_char_p, ctypes.c_int32, ctypes.c_char_p]


class Call:
    def __init__(self, line):
        self.line = line
        self.function, arguments = re.fullmatch(r"(\w+)\((.*)\)", line).groups()
        self.arguments = dict(
            each.split("=", 1) for each in re.split(r", (?=\w+=)", arguments) if each
        )

    def struct(self, name, struct):
        given = bytes.fromhex(self.arguments[name])
        assert len(given) == ctypes.sizeof(struct), (self.line, struct)
        return struct.from_buffer_copy(given)

    def __repr__(self):
        return self.line


def answer(function, status, message=""):
    _library.native.defrec_stub_answer(function.encode(), status, message.encode())


def calls():
    return [Call(line) for line in _library.native.defrec_stub_calls().decode().splitlines()]


def lines():
    return [call.line for call in calls()]


def created_and_destroyed(log):
    """Handles in the order in which they were made, and in which they were given back."""
    created = [
        call.arguments["out"] for call in log if call.arguments.get("out", "").startswith("0x")
    ]
    ends = [call for call in log if call.function.endswith(("_destroy", "_release"))]
    return created, [next(iter(call.arguments.values())) for call in ends]


class StubTest(unittest.TestCase):
    def setUp(self):
        _library.native.defrec_stub_reset()
        self.addCleanup(_library.native.defrec_stub_reset)
