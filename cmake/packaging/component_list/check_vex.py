#!/usr/bin/env python3
"""Fails unless the VEX document is well formed, is that of the component list, and every component
has dates of support; then does the same to copies with a fault each, which have to be found.

check_vex.py bom.json reviewed.json vex.openvex.json
"""
import copy
import datetime
import json
import pathlib
import re
import sys

import vex

JUSTIFICATIONS = {
    "component_not_present",
    "vulnerable_code_not_present",
    "vulnerable_code_not_in_execute_path",
    "vulnerable_code_cannot_be_controlled_by_adversary",
    "inline_mitigations_already_exist",
}
NEEDS = {
    "fixed": "status_notes",
    "affected": "action_statement",
    "not_affected": "justification",
    "under_investigation": "status_notes",
}


def others(bom):
    return [component for component in bom["components"] if component.get("group") != "defrec"]


def check_statement(statement, purls):
    name = statement["vulnerability"]["name"]
    assert re.fullmatch(r"CVE-\d{4}-\d{4,}|GHSA(-\w{4}){3}", name), f"{name} is no CVE or GHSA"
    assert statement["status"] in NEEDS, f"{name}: status {statement['status']}"
    assert statement.get(NEEDS[statement["status"]]), f"{name}: no {NEEDS[statement['status']]}"
    assert statement.get("justification", "component_not_present") in JUSTIFICATIONS, name
    assert statement["products"], f"{name}: no product"
    for product in statement["products"]:
        assert product["subcomponents"], f"{name}: no component of {product['@id']}"
        for purl in [product["@id"], *(part["@id"] for part in product["subcomponents"])]:
            assert purl in purls, f"{name}: {purl} is not in the component list"


def check_reviewed(bom, reviewed):
    datetime.date.fromisoformat(reviewed["reviewed"])
    known = [name for group in reviewed["support"].values() for name in group["components"]]
    assert len(set(known)) == len(known), "a component has dates of support twice"
    missing = {component["name"] for component in others(bom)} - set(known)
    assert not missing, f"without dates of support: {missing}"
    for group in reviewed["support"].values():
        assert group["supplier"] and group["source"].startswith("https://"), group
        assert group["note"] if group["end_of_support"] is None else True, group
        for field in ("security_support_until", "end_of_support"):
            if group[field] is not None:
                datetime.date.fromisoformat(group[field])
    for entry in reviewed["statements"]:
        assert entry["source"], f"{entry['vulnerability']}: no source"
    keys = [(entry["component"], entry["vulnerability"]) for entry in reviewed["statements"]]
    assert len(set(keys)) == len(keys), "a vulnerability of a component is reviewed twice"
    unknown = {component for component, _ in keys} - set(known)
    assert not unknown, f"statements on components without dates of support: {unknown}"


def check(bom, reviewed, document):
    check_reviewed(bom, reviewed)
    for field in ("@context", "@id", "author", "timestamp", "version", "statements"):
        assert document.get(field), f"no {field}"
    assert document["@context"] == vex.CONTEXT
    assert document["timestamp"].startswith(reviewed["reviewed"]), "not the date of the review"
    purls = {component["purl"] for component in bom["components"]}
    for statement in document["statements"]:
        check_statement(statement, purls)
    assert document == vex.vex_document(bom, reviewed), "stale: not what vex.py writes"


def must_fail(what, bom, reviewed, document):
    try:
        check(bom, reviewed, document)
    except (AssertionError, KeyError, ValueError):
        return
    raise SystemExit(f"not found: {what}")


def check_faults(bom, reviewed, document):
    planted = copy.deepcopy(bom)
    planted["components"].append(
        {**others(bom)[0], "name": "planted", "bom-ref": "planted@1", "purl": "pkg:generic/p@1"}
    )
    must_fail("a component without dates", planted, reviewed, document)
    for field in ("@id", "author", "timestamp"):
        must_fail(field, bom, reviewed, {**document, field: ""})
    for field in ("status", "products", "vulnerability"):
        broken = copy.deepcopy(document)
        del broken["statements"][0][field]
        must_fail(field, bom, reviewed, broken)
    undated = copy.deepcopy(reviewed)
    undated["reviewed"] = "soon"
    must_fail("a review without a date", bom, undated, document)


def check_old_version(bom, reviewed):
    """A version before the fix is not called fixed."""
    entry = next(entry for entry in reviewed["statements"] if entry["component"] == "libpng")
    old = {"version": "1.6.39", "purl": "pkg:deb/debian/libpng-dev@1.6.39-2?arch=amd64"}
    assert vex.verdict(old, entry)["status"] == "affected"
    unknown = {"version": "1.6.39", "purl": "pkg:generic/libpng@1.6.39"}
    assert vex.verdict(unknown, entry)["status"] == "under_investigation"


def main():
    bom, reviewed, document = (json.loads(pathlib.Path(path).read_text()) for path in sys.argv[1:])
    check(bom, reviewed, document)
    check_faults(bom, reviewed, document)
    check_old_version(bom, reviewed)
    print(f"{len(document['statements'])} statements on {len(others(bom))} components")


if __name__ == "__main__":
    main()
