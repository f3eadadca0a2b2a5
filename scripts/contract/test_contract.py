#!/usr/bin/env python3
"""What the parser reads and refuses, and that stale copies and breaks of the ABI are found."""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import generate
import header
from contract import Contract
from writers import cpp, stub

SMALL = """
enum { DEFREC_FORMAT_GRAY8 = 1, /**< 1 byte */
       DEFREC_FORMAT_BGR8 = 1u << 1 /**< 3 bytes */ };
/** Of a test. */
typedef struct defrec_small_params {
    uint32_t struct_size;   /**< see DEFREC_INIT */
    uint32_t width, height; /**< of the image @range 2..64 @unit px */
    uint32_t stride;        /**< of the image @default width @range width.. */
    float    weight;        /**< of a term @default 1e-3 (small) @range >0..9 */
    double   place[3];      /**< where it is */
} defrec_small_params;
"""


def read(text):
    return Contract(header.read([("small.h", text)]))


class Reading(unittest.TestCase):
    def test_a_struct(self):
        fields = {field.name: field for field in read(SMALL).structs[0].fields}
        self.assertEqual(
            list(fields), ["struct_size", "width", "height", "stride", "weight", "place"]
        )
        self.assertEqual(
            (fields["height"].range.low, fields["height"].range.high, fields["height"].unit),
            ("2", "64", "px"),
        )
        self.assertEqual((fields["stride"].default, fields["stride"].range.high), ("width", None))
        self.assertEqual(
            (fields["weight"].default, fields["weight"].remark, fields["weight"].range.is_open),
            ("1e-3", "small", True),
        )
        self.assertEqual((fields["place"].offset, fields["place"].size), (24, 24))

    def test_enumerators(self):
        self.assertEqual(read(SMALL).constants, {"DEFREC_FORMAT_GRAY8": 1, "DEFREC_FORMAT_BGR8": 2})

    def test_what_is_not_understood_is_refused_with_its_line(self):
        for old, new, refusal in (
            ("@default width", "@default widht", "there is no widht"),
            ("@range 2..64", "@range 2-64", "@range 2-64 is not understood"),
            ("@unit px", "@units px", "@units of a field is unknown"),
            ("/**< where it is */", "", "small.h:10: defrec_small_params.place has no comment"),
            ("/**< 1 byte */", "", "DEFREC_FORMAT_GRAY8 has no comment"),
            ("double ", "bouble ", "the type bouble is unknown"),
            ("1u << 1", "ONE", "ONE is no number"),
            ("typedef struct", "struct", "small.h:5: typedef expected"),
        ):
            with self.subTest(new), self.assertRaisesRegex(header.HeaderError, refusal):
                read(SMALL.replace(old, new, 1))

    def test_ranges_become_checks(self):
        text = cpp.parameters(read(SMALL))
        self.assertIn('check.integer("height", p.height, 2, 64);', text)
        self.assertIn('check.integer("stride", p.stride, p.width, kNoMax);', text)
        self.assertIn('check.real("weight", p.weight, 0.0f, 9.0f, true);', text)
        self.assertIn("if (p.weight == 0) p.weight = 1e-3f;", text)

    def test_the_stub_refuses_a_parameter_of_a_new_kind(self):
        strange = "/** Turns. */ DEFREC_API defrec_status DEFREC_CALL defrec_turn(float angle);"
        with self.assertRaisesRegex(
            header.HeaderError, "the stub does not understand the parameter float angle"
        ):
            stub.files(read(strange), None)


class Tree(unittest.TestCase):
    """A copy of what the generator reads and writes."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        contract = Contract(generate.describe(generate.ROOT / "include"))
        for path in [f"include/{name}" for name in generate.HEADERS] + [
            path for path, _ in generate.outputs(contract, generate.ROOT)
        ]:
            (self.root / path).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(generate.ROOT / path, self.root / path)

    def run_generator(self, *options):
        made = subprocess.run(
            [sys.executable, "-B", generate.__file__, "--root", self.root, *options],
            capture_output=True,
            text=True,
        )
        return made.returncode, made.stdout + made.stderr

    def edit(self, path, old, new):
        text = (self.root / path).read_text()
        self.assertIn(old, text)
        (self.root / path).write_text(text.replace(old, new, 1))

    def test_the_copies_are_those_of_the_headers(self):
        self.assertEqual(self.run_generator("--verify"), (0, ""))

    def test_a_changed_copy_is_stale(self):
        self.edit("sdk/contract/stage_params.hpp", "510", "511")
        self.assertEqual(
            self.run_generator("--verify"),
            (1, "stale, run scripts/contract/generate.py: sdk/contract/stage_params.hpp\n"),
        )
        self.assertEqual(self.run_generator(), (0, "sdk/contract/stage_params.hpp\n"))
        self.assertEqual(self.run_generator("--verify"), (0, ""))

    def test_another_layout_is_current(self):
        self.edit("bindings/python/defrec/structs.py", "\n\n\n@c_struct", "\n@c_struct")
        self.edit("bindings/csharp/Defrec/Enums.cs", " = 0,", " =\n 0,")
        self.assertEqual(self.run_generator("--verify"), (0, ""))

    def test_a_changed_header_makes_copies_stale(self):
        self.edit("include/defrec_c.h", "@range 1..510", "@range 1..500")
        code, printed = self.run_generator("--verify")
        self.assertEqual(code, 1)
        for path in ("contract.json", "stage_params.hpp", "StageParameters.cs", "structs.py"):
            self.assertIn(path, printed)

    def test_what_breaks_the_abi_is_refused(self):
        for old, new, refusal in (
            (
                "typedef struct defrec_image {",
                "typedef struct defrec_image { uint64_t inserted; /**< first */",
                "defrec_image.struct_size: 4 at 0",
            ),
            (
                "DEFREC_ERROR_BUSY          = -9",
                "DEFREC_ERROR_BUSY = -19",
                "DEFREC_ERROR_BUSY = -9",
            ),
            ("defrec_job_wait(", "defrec_job_waits(", "defrec_job_wait"),
        ):
            with self.subTest(new):
                before = (self.root / "include/defrec_c.h").read_text()
                self.edit("include/defrec_c.h", old, new)
                code, printed = self.run_generator()
                self.assertEqual(code, 1)
                self.assertIn(f"these lines would go: {refusal}", printed)
                (self.root / "include/defrec_c.h").write_text(before)


if __name__ == "__main__":
    unittest.main()
