#!/usr/bin/env python3
"""Writes a page as the C++ source of functions that return its pieces.

embed_page.py PAGE.html HEADER OUTPUT.cpp FUNCTION...
HEADER: declares the functions. PAGE.html: with /*DATA*/ between the pieces of two functions
"""
import pathlib
import sys

# A string literal of more than 64 KiB is beyond what C++ promises.
LITERAL_BYTES = 60000
SOURCE = """// Written by web/embed_page.py; do not edit.
#include "{header}"

using namespace std::string_view_literals;

namespace defrec::cli {{
{functions}}}  // namespace defrec::cli
"""
FUNCTION = """std::span<const std::string_view> {name}() {{
    static constexpr std::string_view kPieces[] = {{
{literals}    }};
    return kPieces;
}}
"""


def character(byte):
    if byte == ord("\n"):
        return "\\n"
    if byte in b'"\\':
        return "\\" + chr(byte)
    # "?" as a number, or it may begin a trigraph.
    if byte == ord("?") or not 0x20 <= byte < 0x7F:
        return f"\\{byte:03o}"
    return chr(byte)


def literals(text):
    content = text.encode()
    parts = (
        content[start : start + LITERAL_BYTES] for start in range(0, len(content), LITERAL_BYTES)
    )
    return "".join(f'    "{"".join(map(character, part))}"sv,\n' for part in parts)


def main():
    page, header, output, *names = sys.argv[1:]
    pieces = pathlib.Path(page).read_text(encoding="utf-8").split("/*DATA*/")
    functions = (
        FUNCTION.format(name=name, literals=literals(piece))
        for name, piece in zip(names, pieces, strict=True)
    )
    pathlib.Path(output).write_text(
        SOURCE.format(header=header, functions="".join(functions)), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
