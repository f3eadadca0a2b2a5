#!/usr/bin/env python3
"""Tests of check.py, generate.py and header.py: what they must find is made in a small tree."""
import pathlib
import tempfile
import unittest

import check
import generate
import header

HEADER = """
// How sure.
struct FrameFound {
    // patches | that must be confirmed | one in
    //   fifty by chance, [in-vain]
    static constexpr ByState<uint32_t> kMinPatches = {30, 60};
    // 1 | no unit | set by hand
    static constexpr double kEighth = 1.0 / 8;
};
"""
SOURCE = """
using decisions::FrameFound;
bool is_found(int patches) {  // at least 7.5
    return patches >= FrameFound::kMinPatches && FrameFound::kEighth > 0;
}
"""
PLACE = f"{header.HEADERS[0]}/states.hpp"
MARKS = "<!-- FrameFound, by scripts/decisions/generate.py -->\nold\n<!-- end of table -->\n"


class TreeTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.tree = pathlib.Path(folder.name)
        self.write(PLACE, HEADER)
        self.write("sdk/tracking/a.cpp", SOURCE)
        self.write("docs/experiments/2026-01-02-in-vain.md", "")

    def write(self, name, text):
        path = self.tree / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path


class CheckTest(TreeTest):
    def numbers(self, statement):
        return [number for _, found in check.bare_numbers(statement).values() for number in found]

    def test_what_stands_in_the_header_passes(self):
        self.assertEqual(check.check(self.tree, {}), [])

    def test_a_bare_number_in_a_comparison_is_found(self):
        for statement, number in (
            ("if (inliers < 10) f();", "10"),
            ("return 12 <= x;", "12"),
            ("x = mean > 1.5 && y;", "1.5"),
            ("is = part >= 0.1 * all;", "0.1"),
            ("is = 20 * inside >= vertices;", "20"),
            ("is = n >= (was_found ? 5 : 1) && y;", "5"),
            ("while (a[3] > 4) ++a;", "4"),
            ("if (size.count() < std::max(8, n)) f();", "8"),
            ("return value > 0x7f;", "0x7f"),
        ):
            self.assertEqual(self.numbers(statement), [number], statement)

    def test_a_constant_is_found(self):
        for statement, numbers in (
            ("constexpr double kReach = 3;", ["3"]),
            ("static constexpr float kNear = 2, kFar = 40;", ["40"]),
            ("constexpr double kSlack[] = {0, 0.05};", ["0.05"]),
            ("constexpr size_t kFewest = 12;\nbool f(size_t n) { return n < kFewest; }", ["12"]),
        ):
            self.assertEqual(self.numbers(statement), numbers, statement)

    def test_a_number_with_a_fraction_is_found(self):
        self.assertEqual(
            self.numbers("const double least = was_found ? 0.05 : 0.12;"), ["0.05", "0.12"]
        )
        self.assertEqual(self.numbers("spacing *= 1.2;"), ["1.2"])

    def test_what_decides_nothing_passes(self):
        for statement in (
            "if (x > 0 && y <= 1 && 2 * z >= w) f();",
            "for (int axis = 0; axis < 3; ++axis) f(axis);",
            "std::array<float, 12> a = b.head<3>() + c[7];",
            "if (a[3 * i] < b[5]) f();",
            "constexpr uint32_t kBits = 12;",
            "constexpr double kNone = std::numeric_limits<double>::quiet_NaN();",
            "constexpr double kInformation = 1 / (Rig::kSigma * Rig::kSigma);",
            "const double centre = 0.5 * width;",
            'fail("at most < 7 are possible");  // x < 9',
            "x = y << 5;",
        ):
            self.assertEqual(self.numbers(statement), [], statement)

    def test_the_place_and_the_statement_are_named(self):
        self.write(
            "sdk/tracking/a.cpp", SOURCE + "bool is_few(int n) {\n    return n\n        < 10;\n}\n"
        )
        self.assertEqual(check.check(self.tree, {}), ["sdk/tracking/a.cpp:8: 10 in: return n < 10"])

    def test_tests_are_not_looked_at(self):
        self.write("sdk/tracking/a_test.cpp", "CHECK(x < 10);\n")
        self.write("sdk/tracking/test_a.hpp", "constexpr double kX = 10;\n")
        self.assertEqual(check.check(self.tree, {}), [])

    def test_what_is_allowed_must_be_there(self):
        allowed = {("tracking/a.cpp", "n < 10"): "for the test"}
        self.assertEqual(
            check.check(self.tree, allowed),
            ["check.py allows what is not there: sdk/tracking/a.cpp: n < 10"],
        )
        self.write("sdk/tracking/a.cpp", SOURCE + "bool is_few(int n) { return n < 10; }\n")
        self.assertEqual(check.check(self.tree, allowed), [])

    def test_a_number_must_be_used(self):
        self.write("sdk/tracking/a.cpp", SOURCE.replace("FrameFound::kEighth", "0"))
        self.assertEqual(
            check.check(self.tree, {}),
            [f"{PLACE}: FrameFound::kEighth is used nowhere"],
        )


class FolderTest(TreeTest):
    def test_the_headers_of_a_folder_are_read_by_name(self):
        self.write(f"{header.HEADERS[0]}/rig.hpp", HEADER.replace("FrameFound", "RigRows"))
        self.write(header.HEADERS[1], HEADER.replace("FrameFound", "Anchors"))
        self.assertEqual(
            [each.name for each in header.read_all(self.tree)], ["RigRows", "FrameFound", "Anchors"]
        )

    def test_a_header_of_a_folder_is_no_source(self):
        self.assertEqual(list(header.sources(self.tree)), ["sdk/tracking/a.cpp"])


class HeaderTest(unittest.TestCase):
    def test_numbers_are_read_with_their_comments(self):
        (decision,) = header.read(HEADER)
        first, second = decision.numbers
        self.assertEqual(
            (first.name, first.value, first.unit), ("min_patches", "30; 60", "patches")
        )
        self.assertEqual(first.decides, "that must be confirmed")
        self.assertEqual(first.source, "one in fifty by chance, [in-vain]")
        self.assertEqual((second.name, second.value, second.unit), ("eighth", "1/8", ""))

    def test_a_member_of_the_settings_is_a_number_of_what_reads_it(self):
        text = "struct Few {\n    // 1 | fewer are few | set by hand\n    double share = 0.2;\n};\n"
        with tempfile.TemporaryDirectory() as folder:
            tree = pathlib.Path(folder)
            for name, line in (("a", "settings_.share"), ("b", "settings.other"), ("c", "share")):
                path = tree / "sdk/tracking" / f"{name}.cpp"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(f"bool is_few(double x) {{ return x > {line}; }}\n")
            (decision,) = header.read(text)
            self.assertEqual(
                (decision.numbers[0].name, decision.numbers[0].value), ("share", "0.2")
            )
            self.assertEqual(header.users(tree, decision), ["sdk/tracking/a.cpp"])

    def test_values_as_a_table_has_them(self):
        for kind, value, text in (
            ("float", "0.46f", "0.46"),
            ("double", "1 / 128.0", "1/128"),
            ("Ratio", "{10, 9}", "10/9"),
            ("ByPass<float>", "{1, 0.2f, 1}", "1, 0.2, 1"),
            ("std::array<double, 2>", "{3, 1.5}", "3, 1.5"),
        ):
            self.assertEqual(header.value_text(kind, value), text)

    def test_a_source_is_asked_for(self):
        without = HEADER.replace("| set by hand", "")
        with self.assertRaisesRegex(header.HeaderError, "header:8: the comment of kEighth is not"):
            header.read(without)
        shared = without.replace(
            "// How sure.", "// How sure.\n// Source: formula 3\n// Judged again by: a.sh"
        )
        (decision,) = header.read(shared)
        self.assertEqual((decision.source, decision.command), ("formula 3", "a.sh"))
        with self.assertRaisesRegex(header.HeaderError, "source of FrameFound with a '.'"):
            header.read(shared.replace("formula 3", "formula 3."))

    def test_a_number_needs_a_decision_and_a_comment(self):
        with self.assertRaisesRegex(header.HeaderError, "outside of a decision"):
            header.read("static constexpr int kX = 3;\n")
        with self.assertRaisesRegex(header.HeaderError, "the comment of kX"):
            header.read("struct A {\n    static constexpr int kX = 3;\n};\n")


class GenerateTest(TreeTest):
    def filled(self, text, places=None):
        decisions = {each.name: each for each in header.read_all(self.tree)}
        page = self.write("docs/tracker/numbers.md", text)
        return generate.filled(self.tree, page, decisions, {} if places is None else places)[1]

    def test_a_table_is_written_between_its_marks(self):
        places = {}
        made = self.filled(f"before\n{MARKS}after\n", places)
        self.assertTrue(made.startswith("before\n<!-- FrameFound"))
        self.assertTrue(made.endswith("<!-- end of table -->\nafter\n"))
        self.assertNotIn("old", made)
        self.assertIn("Decided in `sdk/tracking/a.cpp`.", made)
        self.assertIn(
            (
                "| `min_patches` | 30; 60 | patches | that must be confirmed | one in fifty by"
                " chance, [in vain](../experiments/2026-01-02-in-vain.md) |\n"
            ),
            made,
        )
        self.assertIn("| `eighth` | 1/8 | | no unit | set by hand |\n", made)
        self.assertEqual(list(places), ["FrameFound"])
        self.assertEqual(self.filled(made), made)

    def test_a_mark_of_nothing_or_a_second_table_is_an_error(self):
        with self.assertRaisesRegex(header.HeaderError, "there is no decision FrameLost"):
            self.filled(MARKS.replace("Found", "Lost"))
        with self.assertRaisesRegex(header.HeaderError, "the table of FrameFound already"):
            self.filled(MARKS + MARKS)
        with self.assertRaisesRegex(header.HeaderError, "has no <!-- end of table -->"):
            self.filled(MARKS.partition("old")[0])

    def test_an_experiment_must_exist(self):
        (self.tree / "docs/experiments/2026-01-02-in-vain.md").unlink()
        with self.assertRaisesRegex(header.HeaderError, r"\[in-vain\]: 0 pages"):
            self.filled(MARKS)


if __name__ == "__main__":
    unittest.main()
