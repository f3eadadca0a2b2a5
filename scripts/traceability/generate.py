#!/usr/bin/env python3
"""Writes docs/safety/traceability.md: requirements, functions and stages, each with its tests.

usage: generate.py            writes the page where it is stale
       generate.py --verify   writes nothing, and fails where it is stale
Fails as well where a requirement names a test that is not there, or a function or stage has none.
"""
import argparse
import json
import os
import pathlib
import re
import sys

from requirements import REQUIREMENTS

ROOT = pathlib.Path(__file__).resolve().parents[2]
MOST_TESTS = 10  # of a function, that are named
sys.path.insert(0, str(ROOT / "scripts"))
from test_names import test_names  # noqa: E402

PAGE = ROOT / "docs" / "safety" / "traceability.md"
STAGE = re.compile(r"DEFREC_STAGE_([A-Z]+)$")

HEAD = """# Requirements, functions and their tests

<!-- Written by scripts/traceability/generate.py from the headers and the tests. Do not edit. -->

What a user may require of defrec, with the tests that show it. The tests are part of the source;
`./test.sh all` runs all of them. The test `docs/traceability` holds this page to the headers and to
the tests' names. What happens in each of the known faults, with its test, is listed in
[faults](faults.md); for what this page is meant, in [use in a medical device](soup.md).
"""


def require(condition, problem):
    if not condition:
        sys.exit(f"traceability: {problem}")


def link(definition):
    """A page of docs/ as seen from the page that is written."""
    return os.path.relpath(ROOT / "docs" / definition, PAGE.parent)


def requirements():
    """Rows of the tables of requirements, by their titles."""
    known, numbers = {}, set()
    for title, rows in REQUIREMENTS:
        table = []
        for number, text, definition, tests in rows:
            require(number not in numbers, f"{number} is there twice")
            numbers.add(number)
            require(
                (ROOT / "docs" / definition).is_file(), f"{number}: docs/{definition} is not there"
            )
            require(tests, f"{number} has no test")
            for path, name in tests:
                if path not in known:
                    known[path] = set(test_names(ROOT / path)) if (ROOT / path).is_file() else set()
                require(name in known[path], f'{number}: {path} has no test "{name}"')
            heads = [
                f"{number} | {text} | [{pathlib.Path(definition).stem}]({link(definition)})"
            ] + ["| |"] * (len(tests) - 1)
            table += [f"| {head} | {name} | `{path}` |" for head, (path, name) in zip(heads, tests)]
        yield title, table


def functions(contract):
    texts = {path: path.read_text() for path in sorted((ROOT / "sdk" / "api").glob("*_test.cpp"))}
    for function in contract["functions"]:
        call = re.compile(rf"\b{function['name']}\b")
        found = [f"`{path.name}`" for path, text in texts.items() if call.search(text)]
        require(found, f"no test calls {function['name']}")
        shown = ", ".join(found[:MOST_TESTS])
        more = f" and {len(found) - MOST_TESTS} others" if len(found) > MOST_TESTS else ""
        yield f"| `{function['name']}` | {function['since']} | {shown}{more} |"


def stages(contract):
    values = [value["name"] for enum in contract["enums"] for value in enum["values"]]
    for stage in (match[1].lower() for match in map(STAGE.match, values) if match):
        files = [
            f"docs/stages/{stage}.md",
            f"backends/agreement/{stage}_test.cpp",
            f"conformance/cases/stage/{stage}_cases.cpp",
        ]
        for file in files:
            require((ROOT / file).is_file(), f"{file} of stage {stage} is not there")
        yield f"| {stage} | [{stage}]({link(f'stages/{stage}.md')}) | `{files[1]}` | `{files[2]}` |"


def page():
    contract = json.loads((ROOT / "sdk" / "contract" / "contract.json").read_text())
    text = [HEAD]
    for title, table in requirements():
        text += [
            f"## {title}\n",
            "| | requirement | definition | tests | in |",
            "|---|---|---|---|---|",
            *table,
            "",
        ]
    text += [
        "## Stages\n",
        (
            "The agreement tests compare every backend with the reference, the conformance cases"
            " any plugin.\n"
        ),
    ]
    text += [
        "| stage | definition | agreement | conformance |",
        "|---|---|---|---|",
        *stages(contract),
        "",
    ]
    text += [
        "## Functions of the C API\n",
        (
            "The tests are in `sdk/api`. C# and Python have tests of their own, which name every"
            " function.\n"
        ),
    ]
    text += ["| function | since | tests that call it |", "|---|---|---|", *functions(contract)]
    return "\n".join(text) + "\n"


def main():
    arguments = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2])
    arguments.add_argument("--verify", action="store_true")
    verify = arguments.parse_args().verify
    made = page()
    if PAGE.exists() and PAGE.read_text() == made:
        return
    require(
        not verify, "docs/safety/traceability.md is stale; run scripts/traceability/generate.py"
    )
    PAGE.write_text(made)
    print("docs/safety/traceability.md")


if __name__ == "__main__":
    main()
