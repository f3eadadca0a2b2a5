#!/usr/bin/env python3
"""Tests of what format_csharp.py does around clang-format, and of check_line_length.py."""
import unittest

import check_line_length
import format_csharp

STATEMENTS = """\
using (var a = Open(")"))
using (var b = Open("using ("))
fixed (byte* to = b.Bytes) // while (true)
{
    while (Read(to)) ;
    using (var c = Open('(')) fixed (int* d = c) Copy(d);
}
"""
DISGUISED = """\
using_(var a = Open(")"));
using_(var b = Open("using ("));
while (byte* to = b.Bytes) // while (true)
{
    while (Read(to)) ;
    using_(var c = Open('(')); while (int* d = c) Copy(d);
}
"""


class CSharp(unittest.TestCase):
    def test_statements_are_disguised_and_come_back(self):
        text, loops = format_csharp.disguised(STATEMENTS)
        self.assertEqual(text, DISGUISED)
        self.assertEqual(loops, ["fixed", "while", "fixed"])
        self.assertEqual(format_csharp.undisguised(text, loops), STATEMENTS)

    def test_elements_of_comments_are_joined_and_wrapped(self):
        long = "word " * 18 + '<see cref="Some.Thing"/> and more'
        text = (
            f"    /// <summary>\n    /// One\n    /// two.</summary> <value>{long}</value>\nint"
            " x;\n"
        )
        wanted = (
            "    /// <summary>One two.</summary>\n    /// <value>\n"
            f"    /// {'word ' * 18}\n".rstrip()
            + '\n    /// <see cref="Some.Thing"/> and more\n    /// </value>\nint x;\n'
        )
        self.assertEqual(format_csharp.with_xml_comments(text), wanted)
        self.assertEqual(format_csharp.with_xml_comments(wanted), wanted)

    def test_other_comments_stay(self):
        text = "/// Text.\n/// <summary>Not\n/// closed.\nint x;\n"
        self.assertEqual(format_csharp.with_xml_comments(text), text)


class Lines(unittest.TestCase):
    def test_only_one_word_may_be_longer(self):
        url = "https://example.org/" + "x" * 100
        self.assertFalse(check_line_length.is_too_long("x " * 50))
        self.assertTrue(check_line_length.is_too_long("x " * 50 + "x"))
        self.assertFalse(check_line_length.is_too_long(f"    # {url}"))
        self.assertTrue(check_line_length.is_too_long(f"# See {url}"))


if __name__ == "__main__":
    unittest.main()
