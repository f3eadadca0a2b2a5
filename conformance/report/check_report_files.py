"""Checks written reports from outside: report.json against the schema, junit.xml and index.html for
their form.

check_report_files.py FOLDER_OF_REPORTS SCHEMA
"""
import copy
import html.parser
import json
import pathlib
import sys
import xml.etree.ElementTree

import jsonschema

VOID = {"meta", "input", "img", "br", "link", "hr"}


class Nesting(html.parser.HTMLParser):
    """Fails where an element is closed that is not open, or left open."""

    def __init__(self):
        super().__init__()
        self.open = []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            raise ValueError(f"</{tag}> at {self.getpos()} closes nothing")


def check_schema(schema, report):
    validator = jsonschema.Draft202012Validator(schema)
    validator.validate(report)
    for path, value in (
        ("counts", {}),
        ("cases", [{}]),
        ("digests", {}),
        ("more", 1),
        ("format", 2),
    ):
        edited = copy.deepcopy(report)
        edited[path] = value
        assert not validator.is_valid(edited), f"the schema accepts {path} = {value}"
    edited = copy.deepcopy(report)
    edited["cases"][0]["verdict"] = "failed"
    assert not validator.is_valid(edited), "the schema accepts a failure without a reason"


def check_junit(path, report):
    root = xml.etree.ElementTree.parse(path).getroot()
    assert root.tag == "testsuites"
    counts = report["counts"]["all"]
    assert [int(root.get(key)) for key in ("failures", "skipped")] == [
        counts["failed"],
        counts["skipped"],
    ]
    suites = root.findall("testsuite")
    assert {suite.get("name") for suite in suites} == set(report["counts"]["tiers"])
    by_id = {case.get("name"): case for case in root.iter("testcase")}
    assert len(by_id) == len(report["cases"]) == int(root.get("tests"))
    for case in report["cases"]:
        element = by_id[case["id"]]
        assert (element.find("failure") is not None) == (case["verdict"] == "failed")
        assert (element.find("skipped") is not None) == (case["verdict"] == "skipped")
        if case["verdict"] == "failed":
            assert element.find("failure").get("message") == case["reason"]


def check_page(path, report):
    text = path.read_text(encoding="utf-8")
    nesting = Nesting()
    nesting.feed(text)
    nesting.close()
    assert not nesting.open, f"left open: {nesting.open}"
    for case in report["cases"]:
        assert case["id"] in text


def main(folder, schema_path):
    schema = json.loads(pathlib.Path(schema_path).read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    reports = sorted(pathlib.Path(folder).glob("*/report.json"))
    assert reports, f"no reports in {folder}"
    for path in reports:
        report = json.loads(path.read_text(encoding="utf-8"))
        check_schema(schema, report)
        check_junit(path.parent / "junit.xml", report)
        check_page(path.parent / "index.html", report)
    print(len(reports), "reports are in order")


main(*sys.argv[1:])
