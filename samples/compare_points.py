#!/usr/bin/env python3
"""Fails unless a sample's points are those of `defrec track`, digit for digit.

compare_points.py TRACKED/points.csv SAMPLE.csv

Rows of display.csv that are of no point do not count.
"""
import csv
import sys

COLUMNS = ["frame", "id", "x", "y", "z", "status", "expected_error_mm"]


def rows(path):
    with open(path, newline="") as file:
        return [
            [row[column] for column in COLUMNS]
            for row in csv.DictReader(file)
            if row.get("kind", "point") == "point"
        ]


expected, found = rows(sys.argv[1]), rows(sys.argv[2])
for line, (mine, theirs) in enumerate(zip(found, expected), start=2):
    if mine != theirs:
        sys.exit(f"{sys.argv[2]}:{line}: {mine}, `defrec track` wrote {theirs}")
if len(found) != len(expected) or not found:
    sys.exit(f"{sys.argv[2]} has {len(found)} points, `defrec track` wrote {len(expected)}")
print(f"{len(found)} points equal, digit for digit")
