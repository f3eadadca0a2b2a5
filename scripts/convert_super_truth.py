#!/usr/bin/env python3
"""Writes the labels of the SuPer data set as JSON, which `defrec evaluate --dataset super` reads.

usage: convert_super_truth.py rgb/left_pts.npy [rgb/left_pts.json]

The .npy file holds a pickle, which could run anything: only arrays of numbers, dictionaries, lists
and text are taken from it, and whatever else it names is refused.
"""
import io
import json
import pickle
import sys
from pathlib import Path

import numpy as np

ARRAYS = {
    ("numpy.core.multiarray", "_reconstruct"),
    ("numpy._core.multiarray", "_reconstruct"),
    ("numpy.core.multiarray", "scalar"),
    ("numpy._core.multiarray", "scalar"),
    ("numpy", "ndarray"),
    ("numpy", "dtype"),
    ("_codecs", "encode"),
}


class Unpickler(pickle.Unpickler):
    def find_class(self, module, name):
        if (module, name) not in ARRAYS:
            raise pickle.UnpicklingError(f"{module}.{name} is not part of an array")
        return super().find_class(module, name)


def read_pickle(path):
    """The one object in an .npy file."""
    with open(path, "rb") as file:
        if np.lib.format.read_magic(file) != (1, 0):
            raise ValueError("the file is not of version 1.0 of the format")
        shape, _, dtype = np.lib.format.read_array_header_1_0(file)
        if dtype != object or shape not in ((), (1,)):
            raise ValueError("one pickled object was expected")
        return np.asarray(Unpickler(io.BytesIO(file.read())).load(), dtype=object).item()


def labels_of(path):
    truth = read_pickle(path)
    if not isinstance(truth, dict) or not isinstance(truth.get("gt"), dict):
        raise ValueError("a dictionary with 'gt' was expected")
    labels = {}
    for key, rows in truth["gt"].items():
        rows = np.asarray(rows, dtype=float)
        if rows.ndim != 2 or rows.shape[1] != 3:
            raise ValueError(f"{key}: rows u, v, valid were expected")
        labels[str(key)] = rows.tolist()
    return {"gt": labels}


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    source = Path(sys.argv[1])
    target = Path(sys.argv[2]) if len(sys.argv) == 3 else source.with_suffix(".json")
    try:
        labels = labels_of(source)
    except (OSError, ValueError, pickle.UnpicklingError) as error:
        sys.exit(f"{source}: {error}")
    target.write_text(json.dumps(labels) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
