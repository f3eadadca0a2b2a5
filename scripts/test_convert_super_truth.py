#!/usr/bin/env python3
"""Tests of convert_super_truth.py. Exit status 77: numpy is not installed."""
import pickle
import sys
import tempfile
import unittest
from pathlib import Path

try:
    import numpy as np
except ImportError:
    sys.exit(77)

from convert_super_truth import labels_of


class Touch:
    """A pickle that would create a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


class ConvertTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.file = Path(self.folder.name) / "left_pts.npy"

    def tearDown(self):
        self.folder.cleanup()

    def test_arrays_are_read(self):
        rows = np.array([[1.5, 2, 1], [3, 4, 0]])
        np.save(self.file, {"gt": {"000010": rows}, "SURF": {"000010": rows}}, allow_pickle=True)
        self.assertEqual(labels_of(self.file), {"gt": {"000010": [[1.5, 2, 1], [3, 4, 0]]}})

    def test_whatever_else_is_refused(self):
        target = Path(self.folder.name) / "touched"
        np.save(self.file, {"gt": Touch(target)}, allow_pickle=True)
        with self.assertRaises(pickle.UnpicklingError):
            labels_of(self.file)
        self.assertFalse(target.exists())

    def test_another_shape_is_refused(self):
        for truth in ([1, 2], {"truth": {}}, {"gt": {"000010": np.zeros((20, 2))}}):
            np.save(self.file, np.array(truth, dtype=object), allow_pickle=True)
            with self.assertRaises(ValueError):
                labels_of(self.file)


if __name__ == "__main__":
    unittest.main()
