#!/usr/bin/env python3
"""Writes the tables of decision numbers in the guides from the headers that header.py lists.

usage: generate.py            writes the pages whose tables are stale
       generate.py --verify   writes nothing, and fails where one is stale

A page of docs/ has a table where it has these lines; each decision has one table:

    <!-- FrameFound, by scripts/decisions/generate.py -->
    <!-- end of table -->

[name] in a source becomes a link to the page of docs/experiments whose name ends so.
"""
import argparse
import os
import pathlib
import re
import sys

import header

BEGIN = re.compile(r"<!-- (\w+), by scripts/decisions/generate\.py -->\n")
END = "<!-- end of table -->"
REFERENCE = re.compile(r"\[([a-z0-9-]+)\]")


def link(tree, page, name):
    found = sorted((tree / "docs" / "experiments").glob(f"????-??-??-{name}.md"))
    if len(found) != 1:
        raise header.HeaderError(
            f"[{name}]: {len(found)} pages of docs/experiments end so, 1 expected"
        )
    return f"[{name.replace('-', ' ')}]({os.path.relpath(found[0], page.parent)})"


def with_links(tree, page, text):
    return REFERENCE.sub(lambda match: link(tree, page, match[1]), text)


def table(tree, page, decision):
    rows = [
        [f"`{each.name}`", each.value, each.unit, each.decides, each.source]
        for each in decision.numbers
    ]
    titles = ["name", "value", "unit", "what it decides", "source"]
    if not any(row[-1] for row in rows):
        rows, titles = [row[:-1] for row in rows], titles[:-1]
    lines = [
        titles,
        ["---"] * len(titles),
        *([with_links(tree, page, cell) for cell in row] for row in rows),
    ]
    text = "".join(re.sub(r"\|  (?=\|)", "| ", f"| {' | '.join(line)} |\n") for line in lines)
    return text.replace("| --- ", "|---").replace("--- |", "---|")


def made_text(tree, page, decision):
    notes = []
    if decision.source:
        notes.append(f"Source: {with_links(tree, page, decision.source)}.")
    if decision.command:
        notes.append(f"How far they hold is judged again by `{decision.command}`.")
    users = header.users(tree, decision)
    if not users:
        raise header.HeaderError(f"{decision.name} is used nowhere")
    notes.append(f"Decided in {', '.join(f'`{path}`' for path in users)}.")
    return f"\n{header.wrap(' '.join(notes))}\n\n{table(tree, page, decision)}\n"


def filled(tree, page, decisions, places):
    """The page with its tables; the decisions that it has are added to places."""
    text, made, at = page.read_text(), "", 0
    for begin in BEGIN.finditer(text):
        name, end = begin[1], text.find(END, begin.end())
        if name not in decisions:
            raise header.HeaderError(f"{page.name}: there is no decision {name}")
        if name in places:
            raise header.HeaderError(
                f"{page.name}: {places[name].name} has the table of {name} already"
            )
        if end < 0:
            raise header.HeaderError(f"{page.name}: the table of {name} has no {END}")
        places[name] = page
        made += text[at : begin.end()] + made_text(tree, page, decisions[name])
        at = end
    return text, made + text[at:]


def main():
    arguments = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2])
    arguments.add_argument("--verify", action="store_true")
    verify = arguments.parse_args().verify
    tree, places, stale = header.ROOT, {}, []
    try:
        decisions = {each.name: each for each in header.read_all(tree)}
        for page in sorted((tree / "docs").rglob("*.md")):
            before, made = filled(tree, page, decisions, places)
            if before != made:
                stale.append((page, made))
        for name in decisions:
            if name not in places:
                raise header.HeaderError(f"no page of docs has a table of {name}")
    except header.HeaderError as error:
        sys.exit(str(error))
    names = [str(page.relative_to(tree)) for page, _ in stale]
    if verify and stale:
        sys.exit(f"stale; run scripts/decisions/generate.py: {', '.join(names)}")
    for page, made in stale:
        page.write_text(made)
    print(*names, sep="\n", end="\n" if names else "")


if __name__ == "__main__":
    main()
