#!/usr/bin/env python3
"""Tests of check_line_length.py."""
import unittest

import check_line_length


class Lines(unittest.TestCase):
    def test_only_one_word_may_be_longer(self):
        url = "https://example.org/" + "x" * 100
        self.assertFalse(check_line_length.is_too_long("x " * 50))
        self.assertTrue(check_line_length.is_too_long("x " * 50 + "x"))
        self.assertFalse(check_line_length.is_too_long(f"    # {url}"))
        self.assertTrue(check_line_length.is_too_long(f"# See {url}"))


if __name__ == "__main__":
    unittest.main()
