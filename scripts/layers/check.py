#!/usr/bin/env python3
"""Checks that sources include only what layers.toml allows their folder.

usage: check.py [FOLDER]

FOLDER holds the tree, by default this repository. layers.toml lists every folder of sources, the
lowest first, with the folders whose headers its sources may include. A folder may list only folders
that stand before it, so there is no circle and no arrow upwards. An entry that nothing uses is an
error as well.

Sources of tests are NAME_test.*, test_NAME.* and everything in a folder called testing or tests.
They may also include what lies in the same room, the first two parts of a path (sdk/tracking), and
what [tests] lists for their folder.
"""
import pathlib
import re
import sys
import tomllib

SOURCE = re.compile(r"\.(c|cpp|h|hpp|cu|cuh|comp|glsl)$")
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]+"([^"]+)"', re.MULTILINE)
TEST = re.compile(r"(^|/)(test_[^/]*|[^/]*_test\.[a-z]+|(testing|tests)/[^/]*)$")
ROOTS = ("include", "sdk", "backends", "plugins", "conformance")


def parent(path):
    return str(pathlib.PurePosixPath(path).parent)


def room(folder):
    return "/".join(folder.split("/")[:2])


def find_sources(tree):
    files = (p for root in ROOTS for p in sorted((tree / root).rglob("*")))
    return [p.relative_to(tree).as_posix() for p in files if SOURCE.search(p.name) and p.is_file()]


def find_includes(tree, source):
    """The files of the tree that a source includes; generated headers and systems' do not count."""
    for name in INCLUDE.findall((tree / source).read_text()):
        for place in (pathlib.PurePosixPath(parent(source), name), pathlib.PurePosixPath(name)):
            if (tree / place).is_file():
                yield place.as_posix()
                break


def check_order(layers):
    """layers: folder -> folders that it may include, in the order of the file."""
    before = set()
    for folder, allowed in layers.items():
        for name in allowed:
            if name not in before:
                yield f"layers.toml: {folder} lists {name}, which does not stand before it"
        before.add(folder)


def check_sources(tree, layers, tests):
    used, used_by_tests, folders = set(), set(), set()
    for source in find_sources(tree):
        folder = parent(source)
        is_test = TEST.search(source) is not None
        folders.add(folder)
        if folder not in layers:
            yield f"{source}: layers.toml does not list the folder {folder}"
            continue
        for header in find_includes(tree, source):
            target = parent(header)
            if target == folder or (is_test and room(target) == room(folder)):
                continue
            if target in layers[folder]:
                used.add((folder, target))
            elif is_test and target in tests.get(folder, ()):
                used_by_tests.add((folder, target))
            else:
                yield f"{source}: includes {header}, but {folder} may not include {target}"
    for folder, allowed in layers.items():
        if folder not in folders:
            yield f"layers.toml: the folder {folder} has no sources"
        for name in allowed:
            if (folder, name) not in used:
                yield f"layers.toml: nothing in {folder} includes {name}"
    for folder, allowed in tests.items():
        for name in allowed:
            if (folder, name) not in used_by_tests:
                yield f"layers.toml: no test in {folder} needs {name}"


def check(tree, listed):
    layers, tests = listed["layers"], listed["tests"]
    return [*check_order(layers), *check_sources(tree, layers, tests)]


def main():
    here = pathlib.Path(__file__).resolve()
    tree = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else here.parents[2]
    errors = check(tree, tomllib.loads((here.parent / "layers.toml").read_text()))
    print(*errors, sep="\n", end="\n" if errors else "")
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()
