#!/usr/bin/env python3
"""Writes a page as the C++ source of page.hpp: embed_page.py PAGE.html OUTPUT.cpp"""
import pathlib
import sys

# A string literal of more than 64 KiB is beyond what C++ promises.
LITERAL_BYTES = 60000
SOURCE = """// Written by web/embed_page.py; do not edit.
#include "sdk/cli/report/page.hpp"

using namespace std::string_view_literals;

namespace defrec::cli {{
namespace {{
constexpr std::string_view kBefore[] = {{
{before}}};
constexpr std::string_view kAfter[] = {{
{after}}};
}}  // namespace

std::span<const std::string_view> page_before_data() {{ return kBefore; }}
std::span<const std::string_view> page_after_data() {{ return kAfter; }}
}}  // namespace defrec::cli
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
    parts = (content[start : start + LITERAL_BYTES] for start in range(0, len(content), LITERAL_BYTES))
    return "".join(f'    "{"".join(map(character, part))}"sv,\n' for part in parts)


def main():
    before, after = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8").split("/*DATA*/")
    pathlib.Path(sys.argv[2]).write_text(SOURCE.format(before=literals(before), after=literals(after)), encoding="utf-8")


if __name__ == "__main__":
    main()
