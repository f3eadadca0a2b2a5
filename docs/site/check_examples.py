#!/usr/bin/env python3
"""Compiles every C block of the guides and of the README against the headers. Whole programs are linked too, and where a block
`output` follows, run: they print that. A fragment stands in a function, or, if it defines some, in a file; what it uses without declaring
it is in example_names.h.

usage: check_examples.py ROOT COMPILER LIBRARY_FOLDER WORK_FOLDER
"""
import pathlib
import re
import subprocess
import sys

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.M | re.S)
INCLUDE = re.compile(r"^#include .*$", re.M)


def examples(path):
    """(line of the first line of code, code, expected output or None) of each C block."""
    text = path.read_text()
    blocks = list(FENCE.finditer(text))
    for i, block in enumerate(blocks):
        if block[1] != "c":
            continue
        follower = blocks[i + 1] if i + 1 < len(blocks) else None
        output = follower[2] if follower and follower[1] == "output" else None
        yield text.count("\n", 0, block.start(2)) + 1, block[2], output


def source_of(name, line, code):
    located = f'#line {line} "{name}"\n'
    if "int main(" in code:
        return located + code
    prelude = "\n".join(INCLUDE.findall(code)) + '\n#include "example_names.h"\n'
    body = INCLUDE.sub("", code)
    if not re.search(r"^static ", code, re.M):
        return f"{prelude}void fragment(void);\nvoid fragment(void) {{\n{located}{body}}}\n"
    return prelude + located + body


def main():
    root, compiler, library, work = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3], pathlib.Path(sys.argv[4])
    work.mkdir(parents=True, exist_ok=True)
    flags = ["-std=c11", "-Wall", "-Wextra", "-Werror", f"-I{root}/include", f"-I{root}/docs/site"]
    counts = {"fragments": 0, "programs": 0, "outputs": 0}
    for path in [root / "README.md", *sorted((root / "docs").rglob("*.md"))]:
        name = path.relative_to(root)
        for line, code, output in examples(path):
            base = work / f"{'_'.join(name.with_suffix('').parts)}_{line}"
            source = base.with_suffix(".c")
            source.write_text(source_of(name, line, code))
            if "int main(" not in code:
                subprocess.run([compiler, *flags, "-Wno-unused", "-fsyntax-only", source], check=True)
                counts["fragments"] += 1
                continue
            subprocess.run([compiler, *flags, "-pedantic", source, "-o", base, f"-L{library}", "-ldefrec", "-lm", f"-Wl,-rpath,{library}"],
                           check=True)
            counts["programs"] += 1
            if output is None:
                continue
            printed = subprocess.run([base], check=True, capture_output=True, text=True).stdout
            if printed != output:
                sys.exit(f"{name}:{line}: prints\n{printed}instead of\n{output}")
            counts["outputs"] += 1
    print(", ".join(f"{count} {what}" for what, count in counts.items()))
    if 0 in counts.values():
        sys.exit("nothing was checked of one kind")


main()
