"""Runs tests as if NumPy were not installed: without_numpy.py test_calls ..."""
import sys
import unittest

sys.modules["numpy"] = None
unittest.main(module=None, argv=sys.argv)
