#!/usr/bin/env python3
"""Checks that sources include only what layers.toml allows their folder.

usage: check.py [FOLDER]

FOLDER holds the tree, by default this repository. layers.toml lists every folder of sources, the
lowest first, with the folders whose headers its sources may include. A folder may list only folders
that stand before it, so there is no circle and no arrow upwards. An entry that nothing uses is an
error as well. "backends/*" stands for every folder of sources in backends that has no entry of its
own; in its list, * is the name of that folder.

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


def expand(tree, layers):
    """Every folder with what it may include; for those that a pattern stands for, the pattern."""
    folders = sorted({parent(source) for source in find_sources(tree)})
    expanded, pattern_of = {}, {}
    for entry, allowed in layers.items():
        matches = re.compile(re.escape(entry).replace(r"\*", "([^/]+)")).fullmatch
        if "*" not in entry:
            expanded[entry] = allowed
            continue
        for folder in folders:
            if folder not in layers and (match := matches(folder)):
                expanded[folder] = [name.replace("*", match[1]) for name in allowed]
                pattern_of[folder] = entry
    return expanded, pattern_of


def check_patterns(layers, pattern_of, used):
    """That some folder of each pattern uses each of its entries."""
    for pattern, allowed in layers.items():
        folders = [folder for folder, of in pattern_of.items() if of == pattern]
        if "*" in pattern and not folders:
            yield f"layers.toml: {pattern} stands for no folder"
            continue
        for name in allowed if folders else ():
            own = [(folder, name.replace("*", folder.split("/")[-1])) for folder in folders]
            if not used.intersection(own):
                yield f"layers.toml: nothing in {pattern} includes {name}"


def check_order(layers):
    """layers: folder -> folders that it may include, in the order of the file."""
    before = set()
    for folder, allowed in layers.items():
        for name in allowed:
            if name not in before:
                yield f"layers.toml: {folder} lists {name}, which does not stand before it"
        before.add(folder)


def check_sources(tree, listed, tests):
    layers, pattern_of = expand(tree, listed)
    yield from check_order(layers)
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
            if folder not in pattern_of and (folder, name) not in used:
                yield f"layers.toml: nothing in {folder} includes {name}"
    yield from check_patterns(listed, pattern_of, used)
    for folder, allowed in tests.items():
        for name in allowed:
            if (folder, name) not in used_by_tests:
                yield f"layers.toml: no test in {folder} needs {name}"


def check(tree, listed):
    return list(check_sources(tree, listed["layers"], listed["tests"]))


def main():
    here = pathlib.Path(__file__).resolve()
    tree = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else here.parents[2]
    errors = check(tree, tomllib.loads((here.parent / "layers.toml").read_text()))
    print(*errors, sep="\n", end="\n" if errors else "")
    sys.exit(1 if errors else 0)


if __name__ == "__main__":
    main()
