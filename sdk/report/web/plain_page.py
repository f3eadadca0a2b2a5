#!/usr/bin/env python3
"""Writes a page of a build without npm: the modules that main_plain.js needs as one script, in
index.html.

plain_page.py FOLDER OUTPUT.html STYLE.css...
FOLDER: with index.html and main_plain.js

The modules share one scope there, so that no two may have a function or a constant of the same
name.
"""
import pathlib
import re
import sys

IMPORT = re.compile(r"^import [^;]* from '(\.[\w./]+)';\n", re.MULTILINE)


def modules(path, before=()):
    """The module and those that it imports, each after what it imports."""
    order = list(before)
    for imported in IMPORT.findall(path.read_text(encoding="utf-8")):
        order = modules((path.parent / imported).resolve(), order)
    return order if path in order else [*order, path]


def script(folder):
    texts = (path.read_text(encoding="utf-8") for path in modules(folder / "main_plain.js"))
    return "\n".join(
        re.sub(r"^export ", "", IMPORT.sub("", text), flags=re.MULTILINE) for text in texts
    )


def main():
    folder, output, *styles = map(pathlib.Path, sys.argv[1:])
    style = "".join(path.read_text(encoding="utf-8") for path in styles)
    page = (folder / "index.html").read_text(encoding="utf-8")
    page = page.replace('<html lang="en">', '<html lang="en" data-plain>')
    page = page.replace("/*STYLE*/", style).replace(
        "/*SCRIPT*/", f"'use strict';\n{{\n{script(folder.resolve())}}}\n"
    )
    output.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
