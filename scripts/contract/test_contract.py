#!/usr/bin/env python3
"""What the parser reads and refuses, what an addition to the headers makes, and that stale copies
and breaks of the ABI are found."""
import ast
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import generate
import header
from contract import Contract
from writers import abi, cpp, docs, stages, stub

SMALL = """
enum { DEFREC_FORMAT_GRAY8 = 1, /**< 1 byte */
       DEFREC_FORMAT_BGR8 = 1u << 1 /**< 3 bytes */ };
/** Parameters of a test. */
typedef struct defrec_small_params {
    uint32_t struct_size;   /**< see DEFREC_INIT */
    uint32_t width, height; /**< of the image @range 2..64 @unit px */
    uint32_t stride;        /**< of the image @default width @range width.. */
    float    weight;        /**< of a term @default 1e-3 (small) @range >0..9 */
    double   place[3];      /**< where it is */
} defrec_small_params;
"""


# A frame's result, with an enumeration that is counted and a reason.
RESULT = """
enum { DEFREC_STAGE_FIRST = 0, /**< one */ DEFREC_STAGE_SECOND = 1, /**< two */
       DEFREC_STAGE_COUNT_V1 = 2 /**< all */ };
enum { DEFREC_REASON_FEW_MATCHES = 1u << 0 /**< few @effect degraded @remedy look @since 1.1 */ };
typedef struct defrec_result {
    uint32_t     struct_size;  /**< see DEFREC_INIT */
    uint32_t     reasons;      /**< DEFREC_REASON_*: why */
    double       motion[12];   /**< of all @components 3x4 */
    const float *vertices;     /**< xyz each @count vertex_count @components 3 */
    uint64_t     vertex_count; /**< vertices */
    const char  *name;         /**< of the device */
    const int16_t *depths;     /**< of the image, or NULL @count pixels */
} defrec_result;
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

    def test_arrays_of_a_result(self):
        contract = read(RESULT)
        fields = {field.name: field for field in contract.result.fields}
        self.assertEqual(
            (fields["vertices"].counted_by, fields["vertices"].shape), ("vertex_count", (3,))
        )
        self.assertEqual((fields["motion"].count, fields["motion"].shape), (12, (3, 4)))
        self.assertEqual(contract.result.counts, {"vertex_count"})
        self.assertEqual(
            cpp.reason_names(contract, "-"), [("DEFREC_REASON_FEW_MATCHES", "few-matches")]
        )
        self.assertEqual(cpp.degrading_reasons(contract), ["DEFREC_REASON_FEW_MATCHES"])
        other = read(RESULT.replace("@effect degraded", "@effect the left one: lost"))
        self.assertEqual(cpp.degrading_reasons(other), [])
        self.assertIn(
            "| `DEFREC_REASON_FEW_MATCHES` | few | degraded | look |", docs.reasons(contract)
        )

    def test_stages(self):
        contract = read(RESULT)
        self.assertEqual(contract.stages, ["first", "second"])
        self.assertEqual(
            stages.macro(contract).splitlines(),
            [
                "#define DEFREC_STAGES(X, SEPARATOR) \\",
                "    X(first, FIRST)                 \\",
                "    SEPARATOR()                     \\",
                "    X(second, SECOND)",
            ],
        )

    def test_ends_of_whole_numbers_with_a_default(self):
        self.assertNotIn("at_ends(given", cpp.parameter_ends(read(SMALL)))
        whole = read(SMALL.replace("@default width @range width..", "@default 4 @range 2..9"))
        self.assertIn(
            'at_ends(given, "stride", &defrec_small_params::stride, {2, 9}, check);',
            cpp.parameter_ends(whole),
        )

    def test_a_number_of_enumerators_may_grow(self):
        more = RESULT.replace("COUNT_V1 = 2", "THIRD = 2, /**< x */ DEFREC_STAGE_COUNT_V1 = 3")
        recorded = set(abi.layout(read(RESULT)).splitlines())
        self.assertIn("DEFREC_STAGE_SECOND = 1", recorded)
        self.assertEqual(recorded - set(abi.layout(read(more)).splitlines()), set())

    def test_arrays_and_counts_that_do_not_fit_are_refused(self):
        for old, new, refusal in (
            ("@count vertex_count @comp", "@comp", "defrec_result.vertices: @count is missing"),
            ("@count vertex_count", "@count vertices_count", "there is no vertices_count"),
            ("@components 3x4", "@components 3x3", "defrec_result.motion: @components that are 12"),
            ("@components 3 ", "@components three ", "@components three is not understood"),
            (" @remedy look", "", "DEFREC_REASON_FEW_MATCHES: @remedy is missing"),
            ("@remedy look", "@remedies look", "@remedies of an enumerator is unknown"),
            ("COUNT_V1 = 2", "COUNT_V1 = 3", "DEFREC_STAGE_COUNT_V1 is 3: there are 2"),
        ):
            with self.subTest(new), self.assertRaisesRegex(header.HeaderError, refusal):
                read(RESULT.replace(old, new, 1))

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
        self.assertEqual(self.run_generator("--verify"), (0, ""))

    def test_a_changed_header_makes_copies_stale(self):
        self.edit("include/defrec_c.h", "@range 1..510", "@range 1..500")
        code, printed = self.run_generator("--verify")
        self.assertEqual(code, 1)
        for path in ("contract.json", "stage_params.hpp", "StageParameters.cs", "structs.py"):
            self.assertIn(path, printed)

    def generated(self, path):
        return (self.root / path).read_text()

    def test_a_new_reason_is_named_everywhere(self):
        self.edit(
            "include/defrec_c.h",
            "    DEFREC_REASON_INTERLACED ",
            (
                "    DEFREC_REASON_RED_LIGHT = 1u << 24, /**< no green\n @remedy another lamp */\n "
                "   DEFREC_REASON_INTERLACED "
            ),
        )
        self.assertEqual(self.run_generator()[0], 0)
        for path, line in (
            ("sdk/contract/enumerations.hpp", '    {DEFREC_REASON_RED_LIGHT, "red-light"},'),
            ("samples/c/live_loop.c", '    {DEFREC_REASON_RED_LIGHT, "red light"},'),
            ("bindings/csharp/Defrec/Enums.cs", "        RedLight = 1u << 24,"),
            ("bindings/python/defrec/enums.py", "    RED_LIGHT = 16777216"),
        ):
            self.assertIn(line, self.generated(path).splitlines(), path)
        guides = "".join(path.read_text() for path in (self.root / "docs").rglob("*.md"))
        self.assertIn("\n| `DEFREC_REASON_RED_LIGHT` | no green | | another lamp |\n", guides)

    def test_a_new_array_of_a_result_is_copied_by_the_bindings(self):
        self.edit(
            "include/defrec_c.h",
            "} defrec_result;",
            """    const float *speeds; /**< xyz per template vertex, mm/s
                                  @count vertex_count @components 3 */
    const uint8_t *patch_status; /**< DEFREC_POINT_* per patch @count patch_count */
    float mean_speed; /**< of all @unit mm/s */
} defrec_result;""",
        )
        self.assertEqual(self.run_generator()[0], 0)
        for path, lines in (
            (
                "bindings/python/defrec/result.py",
                (
                    "    speeds: Float32Array",
                    "    patch_status: ByteArray",
                    "    mean_speed: float",
                    '        speeds=copied(r.speeds, "f", (r.vertex_count, 3)),',
                    '        patch_status=copied(r.patch_status, "B", (r.patch_count,)),',
                    "        mean_speed=r.mean_speed,",
                ),
            ),
            (
                "bindings/csharp/Defrec/FrameResult.cs",
                (
                    "        public float[] Speeds { get; private set; } = new float[0];",
                    (
                        "        public PointStatus[] PatchStatus { get; private set; } = new"
                        " PointStatus[0];"
                    ),
                    (
                        "            float[] speeds = NativeArray.Sized(Speeds,"
                        " Check.ArrayLength(result.vertex_count, 3));"
                    ),
                    "        public float MeanSpeed { get; }",
                    "            MeanSpeed = result.mean_speed;",
                ),
            ),
            (
                "bindings/csharp/Defrec/JobArrays.cs",
                (
                    "        public int CopySpeeds(float[] destination)",
                    "        public int CopyPatchStatus(Span<PointStatus> destination)",
                    (
                        "                return Copy(result.speeds, 3 * result.vertex_count,"
                        " sizeof(float), to, capacity);"
                    ),
                ),
            ),
        ):
            for line in lines:
                self.assertIn(line, self.generated(path).splitlines(), path)

    def test_what_the_python_package_imports_and_what_the_headers_name_is_public(self):
        package = "bindings/python/defrec/__init__.py"
        self.edit(
            package,
            "from .memory import Memory\n",
            "from .memory import Memory, share as lend, _hidden\n",
        )
        self.edit(
            "include/defrec_c.h",
            "enum { DEFREC_DISPARITY_ONE =",
            (
                "enum { DEFREC_DISPARITY_TWO = 32 /**< twice as much */ };\n/** Unit. */\nenum {"
                " DEFREC_DISPARITY_ONE ="
            ),
        )
        self.assertEqual(self.run_generator("--verify")[0], 1)
        self.assertEqual(self.run_generator()[0], 0)
        public = ast.literal_eval(
            self.generated(package).partition("__all__ = ")[2].partition("]")[0] + "]"
        )
        self.assertEqual(public[:3], ["BLEND_NODES", "DISPARITY_NONE", "DISPARITY_ONE"])
        self.assertLess({"DISPARITY_TWO", "lend", "Memory", "CutPoint", "track"}, set(public))
        self.assertFalse({"share", "_hidden", "Intrinsics", "ResultStruct"} & set(public))

    def test_a_guide_without_its_table_is_named(self):
        path = next(
            path
            for path in (self.root / "docs").rglob("*.md")
            if "<!-- DEFREC_REASON_*, by" in path.read_text()
        )
        self.edit(path.relative_to(self.root), "<!-- DEFREC_REASON_*, by", "<!-- reasons, by")
        self.assertEqual(
            self.run_generator("--verify"),
            (
                1,
                (
                    "docs: one guide with the line <!-- DEFREC_REASON_*, by"
                    " scripts/contract/generate.py --> expected, there are 0\n"
                ),
            ),
        )

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
