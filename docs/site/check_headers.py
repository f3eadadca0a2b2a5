#!/usr/bin/env python3
"""Every function of the C API says from which threads it may be called, since when it exists and
which errors it returns, and names its parameters; the header's version is that of the newest. Every
error, state, reason and status of a point is in the guide on errors. Doxygen checks that everything
is documented.

usage: check_headers.py defrec_c.h errors.md
"""
import pathlib
import re
import sys

FUNCTION = re.compile(
    r"/\*\*((?:[^*]|\*(?!/))*)\*/\s*DEFREC_API ([\w *]+?)\s*DEFREC_CALL (\w+)\(([^)]*)\);"
)
SPEAK_FOR_THEMSELVES = {"out"}  # besides handles, which are called as their type


IN_GUIDE = (
    "DEFREC_OK",
    "DEFREC_LOST",
    "DEFREC_REASON_DARK",
    "DEFREC_POINT_UNKNOWN",
)  # one of each enumeration that is there


def faults(text):
    functions = FUNCTION.findall(text)
    statuses = set(re.findall(r"\b(DEFREC_ERROR_\w+) *=", text))
    if len(functions) != len(re.findall(r"^DEFREC_API .*DEFREC_CALL", text, re.M)):
        yield "a function has no comment, or is not written as the others are"
    for comment, kind, name, parameters in functions:
        if not re.search(r"@threads (any|one)\b", comment):
            yield f"{name}: @threads any or one is missing"
        if not re.search(r"@since \d+\.\d+", comment):
            yield f"{name}: @since is missing"
        if kind == "defrec_status" and "@errors" not in comment:
            yield f"{name}: @errors is missing"
        for status in re.findall(r"\bDEFREC_ERROR_\w+", comment):
            if status not in statuses:
                yield f"{name}: there is no {status}"
        for parameter in parameters.split(","):
            words = re.findall(r"\w+", parameter)
            is_handle = len(words) == 2 and words[0] == f"defrec_{words[1]}"
            if (
                words != ["void"]
                and not is_handle
                and words[-1] not in SPEAK_FOR_THEMSELVES
                and not re.search(rf"\b{words[-1]}\b", comment)
            ):
                yield f"{name}: {words[-1]} is not explained"


def faults_of_version(text):
    version = tuple(
        int(re.search(rf"#define DEFREC_API_{part} (\d+)", text)[1]) for part in ("MAJOR", "MINOR")
    )
    newest = max(tuple(map(int, found)) for found in re.findall(r"@since (\d+)\.(\d+)", text))
    if version != newest:
        yield f"DEFREC_API_MAJOR and _MINOR are {version}, the newest @since is {newest}"


def faults_of_guide(text, guide):
    enumerations = [
        re.findall(r"\b(DEFREC_\w+) *=", body) for body in re.findall(r"\benum \{([^}]*)\}", text)
    ]
    for one in IN_GUIDE:
        for name in next(names for names in enumerations if one in names):
            if f"| `{name}` |" not in guide:
                yield f"errors.md: {name} has no row"


def main():
    text, guide = (pathlib.Path(path).read_text() for path in sys.argv[1:])
    found = [*faults(text), *faults_of_version(text), *faults_of_guide(text, guide)]
    sys.exit("\n".join(found) if found else 0)


main()
