#!/usr/bin/env python3
"""Writes everything that repeats the public headers: the description sdk/contract/contract.json,
and from it what the writers make. Whole files, and parts of files between marks. scripts/format.sh
lays out the C# and the Python among them; texts that differ in layout alone count as equal.

usage: generate.py            writes what is stale, and names it
       generate.py --verify   writes nothing, and fails where something is stale
       --include FOLDER       reads the headers there
       --root FOLDER          writes there
"""
import argparse
import json
import pathlib
import re
import subprocess
import sys

import header
from contract import Contract
from writers import (
    abi,
    cpp,
    csharp,
    csharp_result,
    docs,
    python_binding,
    python_package,
    python_result,
    samples,
    stages,
    stub,
)

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADERS = ("defrec_c.h", "defrec_plugin.h")
WRITERS = (
    cpp,
    abi,
    stages,
    stub,
    csharp,
    csharp_result,
    python_binding,
    python_result,
    python_package,
    samples,
    docs,
)
LAID_OUT = (".cs", ".py")
LAYOUT = re.compile(r"///?|,(?=\s*[)\]}])|\s+")


def describe(include):
    return header.read([(name, (include / name).read_text()) for name in HEADERS])


def description_text(description):
    """JSON with one line for each field, value and function, so that a difference reads like the
    header's."""
    text = []
    for key, value in description.items():
        if isinstance(value, list):
            items = ",\n".join(described(item) for item in value)
            text.append(f" {json.dumps(key)}: [\n{items}\n ]")
        else:
            text.append(f" {json.dumps(key)}: {json.dumps(value)}")
    return "{\n" + ",\n".join(text) + "\n}\n"


def described(item):
    lists = [key for key in ("values", "fields") if isinstance(item, dict) and key in item]
    if not lists:
        return "  " + json.dumps(item, ensure_ascii=False)
    head = json.dumps(
        {key: value for key, value in item.items() if key != lists[0]}, ensure_ascii=False
    )
    rows = ",\n".join("   " + json.dumps(row, ensure_ascii=False) for row in item[lists[0]])
    return f'  {head[:-1]}, "{lists[0]}": [\n{rows}\n  ]}}'


def replace_part(text, start, end, part, where):
    """text with part between the lines start and end."""
    lines = text.splitlines()
    if lines.count(start) != 1 or lines.count(end) < 1:
        sys.exit(f"{where}: one line {start!r}, and behind it {end!r}, expected")
    first = lines.index(start)
    last = lines.index(end, first)
    return "\n".join([*lines[: first + 1], *part.splitlines(), *lines[last:]]) + "\n"


def outputs(contract, root):
    """(path, text) of everything."""
    yield "sdk/contract/contract.json", description_text(contract.description)
    for writer in WRITERS:
        yield from writer.files(contract, root).items()
        for path, parts in getattr(writer, "parts", lambda *_: {})(contract, root).items():
            text = (root / path).read_text()
            for start, end, part in parts:
                text = replace_part(text, start, end, part, path)
            yield path, text


def is_current(path, text):
    if not path.exists():
        return False
    present = path.read_text()
    if path.suffix in LAID_OUT:
        return LAYOUT.sub("", present) == LAYOUT.sub("", text)
    return present == text


def lay_out(root, paths):
    """Formats what was written, unless root is a copy without the project's scripts."""
    formatter = root / "scripts/format.sh"
    if paths and formatter.exists():
        code = subprocess.run([formatter, *paths]).returncode
        if code not in (0, 77):  # 77: a formatter is missing, which was said
            sys.exit(code)


def main():
    arguments = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2])
    arguments.add_argument("--verify", action="store_true")
    arguments.add_argument("--include", type=pathlib.Path)
    arguments.add_argument("--root", type=pathlib.Path, default=ROOT)
    given = arguments.parse_args()
    try:
        contract = Contract(describe(given.include or given.root / "include"))
        made = dict(outputs(contract, given.root))
    except header.HeaderError as error:
        sys.exit(str(error))
    stale = [path for path, text in made.items() if not is_current(given.root / path, text)]
    if given.verify:
        sys.exit(f"stale, run scripts/contract/generate.py: {', '.join(stale)}" if stale else 0)
    for path in stale:
        (given.root / path).parent.mkdir(parents=True, exist_ok=True)
        (given.root / path).write_text(made[path])
        print(path)
    lay_out(given.root, [given.root / path for path in stale if path.endswith(LAID_OUT)])


if __name__ == "__main__":
    main()
