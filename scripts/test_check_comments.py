#!/usr/bin/env python3
"""Tests of check_comments.py: what it must find is written to files of a folder."""
import pathlib
import tempfile
import unittest

import check_comments


class CheckCommentsTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def lines(self, name, text):
        """The lines of this file that are at fault."""
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        _, faults = check_comments.check(self.folder)
        path.unlink()
        for fault in faults:
            self.assertTrue(fault.startswith(f"{name}:"), fault)
        return [int(fault.split(":")[1]) for fault in faults]

    def test_comments_behind_and_before_code_are_found(self):
        text = "int a;  // Of b\n/// Of c\nint d;  ///< Of e\n"
        self.assertEqual(self.lines("a.cpp", text), [1, 2, 3])
        text = "int a; /**< Of b */\n/** Of c */\n/* Of d */\n"
        self.assertEqual(self.lines("a.h", text), [1, 2, 3])
        self.assertEqual(self.lines("a.cs", "/// <summary>Of a.</summary>\n"), [1])
        self.assertEqual(self.lines("a.sh", "#!/bin/sh\na=1 # Of b\n"), [2])
        self.assertEqual(self.lines("CMakeLists.txt", "# Of a\n"), [1])

    def test_sentences_within_a_comment_are_found(self):
        self.assertEqual(self.lines("a.cuh", "// A block. Of b\n// nothing is kept.\n"), [1])
        self.assertEqual(self.lines("a.comp", "// A block.\n// Of b nothing is kept.\n"), [2])
        text = "/** A block:\n *  @errors none. Of b\n     Of c */\n"
        self.assertEqual(self.lines("a.h", text), [2, 3])

    def test_docstrings_are_found(self):
        text = 'def a():\n    """Of b."""\n\n\nc = 1\n"""Of d."""\n'
        self.assertEqual(self.lines("a.py", text), [2, 6])
        text = 'class A:\n    """A.\n\n    Of b. Of c\n    """\n'
        self.assertEqual(self.lines("a.py", text), [4])
        text = '__doc__ = f"""A. Of {1} b."""\na = 1  # Of c\n'
        self.assertEqual(self.lines("a.py", text), [1, 2])

    def test_other_uses_pass(self):
        text = 'int of;  // of the image, Offset of a\n// The word "Of": not at the start of one\n'
        self.assertEqual(self.lines("a.cpp", text + 'auto a = "// Of b", c = "x. Of d";\n'), [])
        self.assertEqual(self.lines("a.py", 'a = "Of b"\n"""Width of a."""\n'), [])
        self.assertEqual(self.lines("a.sh", 'echo "Of a"; b=$#\n'), [])

    def test_a_quote_in_a_comment_opens_no_string(self):
        text = "// A row's end\nint b = 1'000;  // Of \"c\n// Of d\n"
        self.assertEqual(self.lines("a.cpp", text), [2, 3])

    def test_built_files_are_no_sources(self):
        self.assertEqual(self.lines("build-a/b.cpp", "// Of c\n"), [])


if __name__ == "__main__":
    unittest.main()
