"""The binding's structs, enumerators and functions are those of the ABI's own lists in sdk/abi, all of them."""
import ctypes
import dataclasses
import inspect
import pathlib
import re
import types
import unittest

import defrec
from defrec import _library, enums, structs
from defrec._arrays import BYTES_PER_PIXEL
from defrec.stage import KIND_OF_PARAMS

ABI = pathlib.Path(__file__).resolve().parents[3] / "sdk" / "abi"
PLUGIN_ABI = ("defrec_host", "defrec_stage_table", "defrec_plugin")

PREFIXES = {
    "DEFREC_LOG_": enums.LogLevel,
    "DEFREC_CONTEXT_": enums.ContextFlag,
    "DEFREC_DEVICE_": enums.DeviceKind,
    "DEFREC_STAGE_": enums.StageKind,
    "DEFREC_FEATURE_": enums.DeviceFeature,
    "DEFREC_MEMORY_": enums.MemoryKind,
    "DEFREC_FORMAT_": enums.Format,
    "DEFREC_SOLVER_": enums.Solver,
    "DEFREC_FRAME_": enums.FrameFlag,
    "DEFREC_REASON_": enums.Reason,
    "DEFREC_POINT_": enums.PointStatus,
}
WITHOUT_PREFIX = [enums.Status, enums.Observation, enums.State]


def enumerator(name):
    """The binding's value of DEFREC_<...>, and where it was found."""
    for prefix, kind in PREFIXES.items():
        if name.startswith(prefix) and name[len(prefix) :] in kind.__members__:
            return kind[name[len(prefix) :]]
    plain = name[len("DEFREC_") :]
    for kind in WITHOUT_PREFIX:
        if plain in kind.__members__:
            return kind[plain]
    return getattr(enums, plain, None)


class Abi(unittest.TestCase):
    layout = (ABI / "layout.txt").read_text().splitlines()

    def test_structs(self):
        fields = {name: [] for name in structs.C_STRUCTS}
        for line in self.layout:
            if match := re.fullmatch(r"(\w+)\.(\w+): (\d+) at (\d+)", line):
                struct, field, size, offset = match[1], match[2], int(match[3]), int(match[4])
                if struct in PLUGIN_ABI:
                    continue
                found = getattr(structs.C_STRUCTS[struct], field)
                self.assertEqual((found.size, found.offset), (size, offset), line)
                fields[struct].append(field)
            elif match := re.fullmatch(r"(\w+): (\d+) bytes", line):
                self.assertEqual(ctypes.sizeof(structs.C_STRUCTS[match[1]]), int(match[2]), line)
            else:
                self.assertRegex(line, r"DEFREC_\w+ = ")
        for name, known in fields.items():
            struct = structs.C_STRUCTS[name]
            self.assertEqual([field for field, _ in struct._fields_], known)
            if "struct_size" in known:  # its size is not in the list: the end of the last field, rounded up
                last = getattr(struct, known[-1])
                alignment = ctypes.alignment(struct)
                self.assertEqual(ctypes.sizeof(struct), -(-(last.offset + last.size) // alignment) * alignment)
                self.assertEqual(getattr(struct(), "struct_size"), ctypes.sizeof(struct))

    def test_enumerators(self):
        seen = 0
        for line in self.layout:
            if match := re.fullmatch(r"(DEFREC_\w+) = (-?\d+)", line):
                self.assertEqual(enumerator(match[1]), int(match[2]), line)
                seen += 1
        members = sum(len(kind.__members__) for kind in [*PREFIXES.values(), *WITHOUT_PREFIX])
        constants = [name for name in vars(enums) if name.isupper()]
        self.assertEqual(seen, members + len(constants), "the binding has enumerators that the list does not have")

    def test_functions(self):
        exported = (ABI / "exports_libdefrec.txt").read_text().split()
        self.assertEqual(sorted(_library.PROTOTYPES), exported)
        header = (ABI.parents[1] / "include" / "defrec_c.h").read_text()
        for name, (result, parameters) in _library.PROTOTYPES.items():
            given = re.search(rf"DEFREC_CALL {name}\(([^)]*)\)", header)[1]
            self.assertEqual(len(parameters), 0 if given == "void" else given.count(",") + 1, name)
            self.assertEqual(result is _library.StatusResult, f"defrec_status DEFREC_CALL {name}(" in header, name)

    def test_version(self):
        header = (ABI.parents[1] / "include" / "defrec_c.h").read_text()
        found = tuple(int(re.search(rf"#define DEFREC_API_{part} (\d+)", header)[1]) for part in ("MAJOR", "MINOR"))
        self.assertEqual((_library.API_MAJOR, _library.API_MINOR), found)

    def test_everything_public_is_exported(self):
        for name in defrec.__all__:
            self.assertTrue(hasattr(defrec, name), name)
        for kind in [*PREFIXES.values(), *WITHOUT_PREFIX]:
            self.assertIn(kind.__name__, defrec.__all__)

    def test_everything_public_says_what_it_is(self):
        seen = 0
        for kind in (getattr(defrec, name) for name in defrec.__all__):
            if not inspect.isclass(kind):
                continue
            self.assertNotRegex(kind.__doc__ or "", rf"^$|^{kind.__name__}\(", kind)
            self.assertIn(kind.__init__.__doc__, (None, object.__init__.__doc__, Exception.__init__.__doc__), kind)
            for name, member in vars(kind).items():
                if not name.startswith("_") and isinstance(member, (types.FunctionType, property)):
                    self.assertTrue(inspect.getdoc(getattr(kind, name)), f"{kind.__name__}.{name}")
                    seen += 1
        self.assertGreater(seen, 30)

    def test_every_field_of_what_the_library_tells_is_public(self):
        for struct, public in (
            (structs.ResultStruct, defrec.Result),
            (structs.TemplateInfo, defrec.TemplateData),
            (structs.DeviceInfoStruct, defrec.DeviceInfo),
            (structs.PluginInfoStruct, defrec.PluginInfo),
        ):
            known = {name for name, _ in struct._fields_ if not name.endswith(("struct_size", "reserved", "_count"))}
            if {"width", "height"} < known:
                known = known - {"width", "height"} | {"size"}
            self.assertEqual({field.name for field in dataclasses.fields(public)}, known)

    def test_every_stage_has_its_parameters_and_arrays(self):
        self.assertEqual(list(KIND_OF_PARAMS.values()), list(enums.StageKind))
        self.assertLessEqual({f"{kind.name.title()}Stage" for kind in enums.StageKind}, set(defrec.__all__))

    def test_every_format_has_its_size(self):
        self.assertEqual(list(BYTES_PER_PIXEL), list(enums.Format))

    def test_unknown_values(self):
        self.assertEqual(enums.State(77).name, "UNKNOWN_77")
        self.assertEqual(enums.State(77), 77)
        self.assertEqual(enums.Reason(1 << 20 | 1) & enums.Reason.DARK, enums.Reason.DARK)
        with self.assertRaises(ValueError):
            enums.State("lost")
