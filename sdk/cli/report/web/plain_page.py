#!/usr/bin/env python3
"""Writes the page of a build without npm: the modules that main_plain.js needs as one script, in index.html.

plain_page.py OUTPUT.html

The modules share one scope there, so that no two may have a function or a constant of the same name.
"""
import pathlib
import re
import sys

WEB = pathlib.Path(__file__).resolve().parent
IMPORT = re.compile(r"^import .* from '\./([\w.]+)';\n", re.MULTILINE)


def modules(name, before=()):
    """The module and those that it imports, each after what it imports."""
    order = list(before)
    for imported in IMPORT.findall((WEB / name).read_text(encoding="utf-8")):
        order = modules(imported, order)
    return order if name in order else [*order, name]


def script():
    texts = ((WEB / name).read_text(encoding="utf-8") for name in modules("main_plain.js"))
    return "\n".join(re.sub(r"^export ", "", IMPORT.sub("", text), flags=re.MULTILINE) for text in texts)


def main():
    page = (WEB / "index.html").read_text(encoding="utf-8")
    page = page.replace('<html lang="en">', '<html lang="en" data-plain>')
    page = page.replace("/*STYLE*/", (WEB / "report.css").read_text(encoding="utf-8")).replace("/*SCRIPT*/", f"'use strict';\n{{\n{script()}}}\n")
    pathlib.Path(sys.argv[1]).write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
