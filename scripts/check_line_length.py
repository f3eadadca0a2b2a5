#!/usr/bin/env python3
"""Checks that lines of sources have at most 100 characters. A line of one word, such as a URL,
cannot be broken and may be longer. Markdown has a check of its own, check_markdown.py.

usage: check_line_length.py FOLDER
"""
import argparse
import pathlib
import re
import sys

from check_markdown import MAX_LINE, NO_SOURCES

KINDS = re.compile(
    r".*\.(c|h|cpp|hpp|cu|cuh|comp|glsl|cs|py|sh|js|mjs|css|html|cmake|txt|in|map|yaml|yml|toml|xml"
    r"|csproj|mk)|CMakePresets\.json|.*\.schema\.json|Snakefile|rules|run"
    r"|\.clang-(format|tidy)|\.editorconfig"
)
# Tools recorded these, and an override of lintian has to be one line.
EXCLUDED = re.compile(r"sdk/abi/layout\.txt|sdk/fuzz/corpus/.*|cmake/packaging/deb/lintian/.*")
COMMENT = re.compile(r"^\W*\s")


def sources(folder):
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if any(NO_SOURCES.match(part) and part != ".ci" for part in name.parts[:-1]):
            continue
        if KINDS.fullmatch(path.name) and not EXCLUDED.fullmatch(str(name)) and path.is_file():
            yield path


def is_too_long(line):
    return len(line) > MAX_LINE and len(COMMENT.sub("", line).split()) > 1


def main():
    parser = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2])
    parser.add_argument("folder", type=pathlib.Path)
    folder = parser.parse_args().folder
    paths = list(sources(folder))
    count = 0
    for path in paths:
        for number, line in enumerate(path.read_text().split("\n"), 1):
            if is_too_long(line):
                count += 1
                print(f"{path.relative_to(folder)}:{number}: {len(line)} characters, at most 100")
    if not paths:
        sys.exit("no sources")
    sys.exit(f"{count} lines of {len(paths)} files" if count else 0)


if __name__ == "__main__":
    main()
