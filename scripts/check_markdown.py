#!/usr/bin/env python3
"""Checks Markdown files: lines of at most 100 characters, table cells of at most 240, guides of at
most 400 lines, and no link to a file or heading that is missing. Code blocks, tables and lines that
cannot be broken (one link, one URL) may be wider than 100.

usage: check_markdown.py [--links-only] FOLDER
"""
import argparse
import pathlib
import re
import sys

MAX_LINE = 100
MAX_CELL = 240
MAX_GUIDE = 400  # lines
NO_GUIDES = re.compile(r"docs/(experiments/|safety/(faults|traceability)\.md$)")
LINK = re.compile(r"\]\(([^)\s]+)\)")
UNBREAKABLE = re.compile(r"\[[^\]]*\]\([^)]*\)|`[^`]*`")  # a link, inline code
NO_SOURCES = re.compile(r"^(build.*|out|node_modules|\.(?!github).*)$")  # names of folders


def markdown_files(folder):
    for path in sorted(folder.rglob("*.md")):
        if not any(NO_SOURCES.match(part) for part in path.relative_to(folder).parts[:-1]):
            yield path


def prose_lines(text):
    """(number, line) of each line outside of code blocks."""
    in_fence = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.lstrip().startswith("```"):
            in_fence = not in_fence
        elif not in_fence and not line.startswith("    "):
            yield number, line


def anchors(path):
    """The anchors that code hosts give to the headings of a page."""
    found = set()
    for _, line in prose_lines(path.read_text()):
        if heading := re.match(r"#+ (.*)", line):
            slug = re.sub(r"[^\w\- ]", "", heading[1].strip().lower()).replace(" ", "-")
            same = re.compile(rf"{re.escape(slug)}(-\d+)?")
            repeated = sum(same.fullmatch(anchor) is not None for anchor in found)
            found.add(f"{slug}-{repeated}" if repeated else slug)
    return found


def width_faults(text):
    for number, line in prose_lines(text):
        if line.startswith("|"):
            longest = max(len(cell.strip()) for cell in line.split("|"))
            if longest > MAX_CELL:
                yield number, f"a table cell of {longest} characters, at most {MAX_CELL}"
        elif len(line) > MAX_LINE:
            words = UNBREAKABLE.sub("x", re.sub(r"^ *([-*]|\d+\.) ", "", line)).split()
            if len(words) > 1:
                yield number, f"{len(line)} characters, at most {MAX_LINE}"


def length_faults(name, text):
    lines = len(text.splitlines())
    is_guide = name.startswith("docs/") and not NO_GUIDES.match(name)
    if is_guide and lines > MAX_GUIDE:
        yield MAX_GUIDE + 1, f"a guide of {lines} lines, at most {MAX_GUIDE}"


def link_faults(path, text):
    for number, line in prose_lines(text):
        for target in LINK.findall(re.sub(r"`[^`]*`", "", line)):
            file, _, anchor = target.partition("#")
            linked = path.parent / file if file else path
            if re.match(r"[a-z]+:", target):
                continue
            if not linked.exists():
                yield number, f"{file} is not there"
            elif anchor and linked.suffix == ".md" and anchor not in anchors(linked):
                yield number, f"{target}: there is no such heading"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--links-only", action="store_true", help="not the lengths")
    parser.add_argument("folder", type=pathlib.Path)
    arguments = parser.parse_args()

    paths = list(markdown_files(arguments.folder))
    faults = []
    for path in paths:
        text = path.read_text()
        name = path.relative_to(arguments.folder).as_posix()
        found = list(link_faults(path, text))
        if not arguments.links_only:
            found += [*width_faults(text), *length_faults(name, text)]
        faults += [f"{name}:{number}: {what}" for number, what in sorted(found)]
    print(f"{len(paths)} Markdown files")
    sys.exit("\n".join(faults) or not paths)


if __name__ == "__main__":
    main()
