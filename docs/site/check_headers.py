#!/usr/bin/env python3
"""Every function of the C API says from which threads it may be called, since when it exists and
which errors it returns, and names its parameters; the header's version is that of the newest. Every
error, state, reason and status of a point is in the guide on errors. Doxygen checks that everything
is documented.

usage: check_headers.py contract.json errors.md
"""
import json
import pathlib
import re
import sys

SPEAK_FOR_THEMSELVES = {"out"}  # besides handles, which are called as their type


IN_GUIDE = (
    "DEFREC_OK",
    "DEFREC_LOST",
    "DEFREC_REASON_DARK",
    "DEFREC_POINT_UNKNOWN",
)  # one of each enumeration that is there


def faults(contract):
    statuses = {value["name"] for enum in contract["enums"] for value in enum["values"]}
    for function in contract["functions"]:
        name, comment = function["name"], function["summary"] + " " + function.get("errors", "")
        if function.get("threads") not in ("any", "one"):
            yield f"{name}: @threads any or one is missing"
        if "since" not in function:
            yield f"{name}: @since is missing"
        if function["returns"] == "defrec_status" and "errors" not in function:
            yield f"{name}: @errors is missing"
        for status in re.findall(r"\bDEFREC_ERROR_\w+", comment):
            if status not in statuses:
                yield f"{name}: there is no {status}"
        for parameter in function["parameters"]:
            is_handle = parameter["type"] == f"defrec_{parameter['name']}"
            is_explained = re.search(rf"\b{parameter['name']}\b", comment)
            if not (is_handle or is_explained or parameter["name"] in SPEAK_FOR_THEMSELVES):
                yield f"{name}: {parameter['name']} is not explained"


def versions(described):
    """Every @since of the C API below described."""
    for value in described.values() if isinstance(described, dict) else described:
        if isinstance(value, (dict, list)):
            yield from versions(value)
    if isinstance(described, dict) and re.fullmatch(r"\d+\.\d+", described.get("since", "")):
        yield tuple(map(int, described["since"].split(".")))


def faults_of_version(contract):
    version = tuple(contract["versions"][f"DEFREC_API_{part}"] for part in ("MAJOR", "MINOR"))
    if version != (newest := max(versions(contract))):
        yield f"DEFREC_API_MAJOR and _MINOR are {version}, the newest @since is {newest}"


def faults_of_guide(contract, guide):
    enumerations = [[value["name"] for value in enum["values"]] for enum in contract["enums"]]
    for one in IN_GUIDE:
        for name in next(names for names in enumerations if one in names):
            if f"| `{name}` |" not in guide:
                yield f"errors.md: {name} has no row"


def main():
    contract = json.loads(pathlib.Path(sys.argv[1]).read_text())
    guide = pathlib.Path(sys.argv[2]).read_text()
    found = [*faults(contract), *faults_of_version(contract), *faults_of_guide(contract, guide)]
    sys.exit("\n".join(found) if found else 0)


main()
