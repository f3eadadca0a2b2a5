"""The binding's structs, enumerators and functions are those of the description of the headers, all
of them."""
import ctypes
import dataclasses
import inspect
import re
import types
import unittest

import defrec
from defrec import _library, enums, structs
from defrec._struct import C_STRUCTS
from defrec._arrays import BYTES_PER_PIXEL
from description import CONTRACT, STRUCTS

ENUMERATORS = {
    value["name"]: value["value"] for enum in CONTRACT["enums"] for value in enum["values"]
}

PREFIXES = {
    "DEFREC_LOG_": enums.LogLevel,
    "DEFREC_CONTEXT_": enums.ContextFlag,
    "DEFREC_DEVICE_": enums.DeviceKind,
    "DEFREC_STAGE_": enums.StageKind,
    "DEFREC_FEATURE_": enums.DeviceFeature,
    "DEFREC_MEMORY_": enums.MemoryKind,
    "DEFREC_FORMAT_": enums.Format,
    "DEFREC_SCAN_": enums.Scan,
    "DEFREC_FIELD_": enums.Field,
    "DEFREC_SOLVER_": enums.Solver,
    "DEFREC_SELF_CALIBRATION_": enums.SelfCalibration,
    "DEFREC_EVIDENCE_": enums.Evidence,
    "DEFREC_FOUND_": enums.Found,
    "DEFREC_BODY_STATE_": enums.BodyState,
    "DEFREC_BODY_": enums.BodyMode,
    "DEFREC_REGION_": enums.RegionFlag,
    "DEFREC_FRAME_": enums.FrameFlag,
    "DEFREC_REASON_": enums.Reason,
    "DEFREC_VIEW_": enums.View,
    "DEFREC_POINT_": enums.PointStatus,
    "DEFREC_VERDICT_": enums.Verdict,
    "DEFREC_DEFORMATION_": enums.Deformation,
    "DEFREC_FREE_": enums.FreeMotionKind,
    "DEFREC_REGISTRATION_": enums.RegistrationFlag,
    "DEFREC_PLAN_": enums.PlanFlag,
    "DEFREC_HAND_EYE_": enums.HandEyeFlag,
    "DEFREC_PREDICTED_": enums.PredictionBasis,
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
    def test_structs(self):
        self.assertEqual(list(C_STRUCTS), list(STRUCTS))
        for described in STRUCTS.values():
            struct = C_STRUCTS[described["name"]]
            made = [
                (name, getattr(struct, name).size, getattr(struct, name).offset)
                for name, _ in struct._fields_
            ]
            self.assertEqual(
                made,
                [(field["name"], field["size"], field["offset"]) for field in described["fields"]],
                struct,
            )
            self.assertEqual(ctypes.sizeof(struct), described["size"], struct)
            if made[0][0] == "struct_size":
                self.assertEqual(getattr(struct(), "struct_size"), described["size"], struct)

    def test_enumerators(self):
        for name, value in ENUMERATORS.items():
            self.assertEqual(enumerator(name), value, name)
        members = sum(len(kind.__members__) for kind in [*PREFIXES.values(), *WITHOUT_PREFIX])
        constants = [name for name in vars(enums) if name.isupper()]
        self.assertEqual(
            len(ENUMERATORS),
            members + len(constants),
            "the binding has enumerators that the header does not have",
        )

    def test_functions(self):
        described = {function["name"]: function for function in CONTRACT["functions"]}
        self.assertEqual(list(_library.PROTOTYPES), list(described))
        for name, (result, parameters) in _library.PROTOTYPES.items():
            self.assertEqual(len(parameters), len(described[name]["parameters"]), name)
            self.assertEqual(
                result is _library.StatusResult, described[name]["returns"] == "defrec_status", name
            )

    def test_version(self):
        found = tuple(CONTRACT["versions"][f"DEFREC_API_{part}"] for part in ("MAJOR", "MINOR"))
        self.assertEqual((_library.API_MAJOR, _library.API_MINOR), found)

    def test_every_parameter_says_its_default_and_range(self):
        for described in STRUCTS.values():
            source = inspect.getsource(C_STRUCTS[described["name"]])
            for field in described["fields"]:
                if number := re.fullmatch(r"[\d.e-]+", field.get("default", "")):
                    self.assertRegex(
                        source,
                        rf"{field['name']}: \w+\n    \"\"\"[^\"]*\b{number[0]}\b",
                        described["name"],
                    )

    def test_everything_public_is_exported(self):
        public = {
            name
            for name, value in vars(defrec).items()
            if not name.startswith("_") and not isinstance(value, types.ModuleType)
        }
        self.assertCountEqual(defrec.__all__, public)
        for kind in [*PREFIXES.values(), *WITHOUT_PREFIX]:
            self.assertIn(kind.__name__, defrec.__all__)

    def test_everything_public_says_what_it_is(self):
        seen = 0
        for kind in (getattr(defrec, name) for name in defrec.__all__):
            if not inspect.isclass(kind):
                continue
            self.assertNotRegex(kind.__doc__ or "", rf"^$|^{kind.__name__}\(", kind)
            self.assertIn(
                kind.__init__.__doc__,
                (None, object.__init__.__doc__, Exception.__init__.__doc__),
                kind,
            )
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
            known = {
                name
                for name, _ in struct._fields_
                if not name.endswith(("struct_size", "reserved", "reserved2", "_count"))
            }
            if {"width", "height"} < known:
                known = known - {"width", "height"} | {"size"}
            self.assertEqual({field.name for field in dataclasses.fields(public)}, known)

    def test_every_stage_has_its_arrays(self):
        self.assertLessEqual(
            {f"{kind.name.title()}Stage" for kind in enums.StageKind}, set(defrec.__all__)
        )

    def test_every_format_has_its_size(self):
        self.assertEqual(list(BYTES_PER_PIXEL), list(enums.Format))

    def test_unknown_values(self):
        self.assertEqual(enums.State(77).name, "UNKNOWN_77")
        self.assertEqual(enums.State(77), 77)
        self.assertEqual(enums.Reason(1 << 20 | 1) & enums.Reason.DARK, enums.Reason.DARK)
        with self.assertRaises(ValueError):
            enums.State("lost")
