#!/usr/bin/env python3
"""Writes docs/safety/faults.md from the faults in rows.py and the tests that bear their numbers.

usage: generate.py            writes the page where it is stale
       generate.py --verify   writes nothing, and fails where it is stale
Fails as well where a fault has no test and no reason why, and where a test bears the number of
none.
"""
import argparse
import collections
import pathlib
import re
import sys

from rows import SECTIONS, WITHOUT_TEST

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
from test_names import test_names  # noqa: E402

FOLDERS = ("backends", "conformance", "plugins", "sdk")
PAGE = ROOT / "docs" / "safety" / "faults.md"
NUMBERS = re.compile(r"rows? (\d+(?:(?:, | and |-| to )\d+)*):")

HEAD = """# Faults and how they are answered

<!-- Written by scripts/faults/generate.py from the names of the tests. Do not edit. -->

A wrong call is an error code and changes nothing; a scene that cannot be followed is a success with
a state and reasons. Old geometry is never handed out as new. Each fault has a number; the tests
that provoke it and assert the answer bear it in their names (`row 79: ...`), in the files that the
last column names. The test `docs/faults` holds this page to them.
"""


def numbers_of(name):
    """The faults that a test's name bears: of "rows 3-5: ..." 3, 4, 5; also later ones ("and row 4:
    ...")."""
    found = set()
    for match in NUMBERS.finditer(name):
        parts = re.split(r"(, | and |-| to )", match.group(1))
        found.add(int(parts[0]))
        for join, number in zip(parts[1::2], parts[2::2]):
            first = int(parts[parts.index(number) - 2]) if join in ("-", " to ") else int(number)
            found.update(range(first, int(number) + 1))
    return found


def tests():
    """Row number -> [(file, name)] in the order of files and lines."""
    paths = sorted(
        str(path.relative_to(ROOT))
        for folder in FOLDERS
        for path in (ROOT / folder).rglob("*_test.cpp")
    )
    found = collections.defaultdict(list)
    for path in paths:
        for name in test_names(ROOT / path):
            if not re.match(r"rows? \d", name):
                continue
            for number in numbers_of(name):
                found[number].append((path, re.sub(NUMBERS, "", name, count=1).strip()))
    return found


def page(found):
    text = [HEAD]
    for title, rows in SECTIONS:
        text.append(f"## {title}\n\n| row | fault | answer | tests |\n|---|---|---|---|")
        for number, fault, answer in rows:
            cells = [
                f"`{path}`" for path in dict.fromkeys(path for path, _ in found.get(number, []))
            ]
            if number in WITHOUT_TEST:
                cells.append(WITHOUT_TEST[number])
            text.append(f"| {number} | {fault} | {answer} | {', '.join(cells)} |")
        text.append("")
    return "\n".join(text).rstrip() + "\n"


def main():
    arguments = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2])
    arguments.add_argument("--verify", action="store_true")
    verify = arguments.parse_args().verify
    found = tests()
    known = [number for _, rows in SECTIONS for number, _, _ in rows]
    if known != sorted(set(known)):
        sys.exit("rows.py: the numbers do not grow")
    for number in known:
        if number not in found and number not in WITHOUT_TEST:
            sys.exit(f"row {number}: no test bears this number, and rows.py does not say why")
    for number in sorted(set(found) - set(known)):
        sys.exit(f"row {number}: {found[number]} bear the number of no fault")
    made = page(found)
    if PAGE.exists() and PAGE.read_text() == made:
        return
    if verify:
        sys.exit("docs/safety/faults.md is stale; run scripts/faults/generate.py")
    PAGE.write_text(made)
    print("docs/safety/faults.md")


if __name__ == "__main__":
    main()
