#!/usr/bin/env python3
"""Writes the table of all backends in docs/benchmarks.md from the certified conformance reports.

usage: generate.py            writes the table where it is stale
       generate.py --verify   writes nothing, and fails where it is stale
"""
import argparse
import json
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "benchmarks.md"
REPORTS = ROOT / "conformance" / "certified"
BEGIN = "<!-- by scripts/benchmarks/generate.py from conformance/certified -->\n"
END = "<!-- end of table -->\n"
ERROR = re.compile(r"sequence\.error_(median|p95)_")


def errors_of(report):
    """Sequence -> "median / p95" of the points in view, mm."""
    found = {}
    for case in report["cases"]:
        if case["tier"] != "sequence":
            continue
        errors = {
            match[1]: metric["maximum"]
            for metric in case["metrics"]
            if (match := ERROR.match(metric["name"]))
        }
        name = case["id"].removeprefix("sequence/")
        found[name] = f"{errors['median']:.4f} / {errors['p95']:.3f}"
    return found


def table():
    reports = [json.loads(path.read_text()) for path in sorted(REPORTS.glob("*.json"))]
    columns = [errors_of(report) for report in reports]
    names = sorted(columns[0])
    if any(sorted(column) != names for column in columns):
        sys.exit("the certified reports have other sequences than each other")
    rows = [
        ["sequence", *(f"`{report['plugin']['name']}`" for report in reports)],
        *([name, *(column[name] for column in columns)] for name in names),
        ["device", *(report["device"]["name"] for report in reports)],
        ["commit", *(report["suite"]["revision"][:7] for report in reports)],
        ["date", *(report["run"]["started"][:10] for report in reports)],
    ]
    lines = [f"| {' | '.join(row)} |\n" for row in rows]
    lines.insert(1, "|---" * len(rows[0]) + "|\n")
    return "".join(lines)


def main():
    arguments = argparse.ArgumentParser(usage=__doc__.partition("usage: ")[2])
    arguments.add_argument("--verify", action="store_true")
    verify = arguments.parse_args().verify
    text = PAGE.read_text()
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        sys.exit(f"docs/benchmarks.md has no {BEGIN.strip()} or no {END.strip()}")
    made = f"{before}{BEGIN}\n{table()}\n{END}{after}"
    if made == text:
        return
    if verify:
        sys.exit("docs/benchmarks.md is stale; run scripts/benchmarks/generate.py")
    PAGE.write_text(made)
    print("docs/benchmarks.md")


if __name__ == "__main__":
    main()
