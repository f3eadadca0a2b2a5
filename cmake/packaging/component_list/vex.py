#!/usr/bin/env python3
"""Writes the VEX document (OpenVEX 0.2.0, JSON) of a component list: what is known of each
vulnerability that was reviewed, in the versions that are listed.

vex.py bom.json reviewed.json OUT
"fixed" is only said of a version that is not older than the one with the fix. An older one is
"affected", and one that cannot be compared "under_investigation".
"""
import json
import pathlib
import re
import subprocess
import sys
import urllib.parse
import uuid

CONTEXT = "https://openvex.dev/ns/v0.2.0"


def debian_version(purl):
    if not purl.startswith("pkg:deb/debian/"):
        return None
    return urllib.parse.unquote(purl.partition("@")[2].partition("?")[0])


def numbers(version):
    return [int(number) for number in re.findall(r"[0-9]+", version)]


def has_fix(component, reviewed):
    """None where the versions cannot be compared."""
    if "fixed_in" in reviewed:
        return numbers(component["version"]) >= numbers(reviewed["fixed_in"])
    installed = debian_version(component["purl"])
    if installed is None:
        return None
    compare = ["dpkg", "--compare-versions", installed, "ge", reviewed["fixed_in_debian"]]
    return subprocess.run(compare, check=False).returncode == 0


def verdict(component, reviewed):
    if reviewed["status"] != "fixed":
        return {
            "status": reviewed["status"],
            "justification": reviewed["justification"],
            "impact_statement": reviewed["impact"],
        }
    fixed = has_fix(component, reviewed)
    version = reviewed.get("fixed_in") or reviewed["fixed_in_debian"]
    if fixed is None:
        return {"status": "under_investigation", "status_notes": f"Debian fixed it in {version}."}
    if fixed:
        return {"status": "fixed", "status_notes": f"Fixed in {version}."}
    return {"status": "affected", "action_statement": f"Update to {version} or newer."}


def statement(bom, component, reviewed):
    ref = component["bom-ref"]
    users = {entry["ref"] for entry in bom["dependencies"] if ref in entry.get("dependsOn", [])}
    return {
        "vulnerability": {"name": reviewed["vulnerability"]},
        "products": [
            {"@id": part["purl"], "subcomponents": [{"@id": component["purl"]}]}
            for part in bom["components"]
            if part["bom-ref"] in users
        ],
        **verdict(component, reviewed),
    }


def vex_document(bom, reviewed):
    by_name = {component["name"]: component for component in bom["components"]}
    document = {
        "@context": CONTEXT,
        "author": "the defrec developers",
        "timestamp": f"{reviewed['reviewed']}T00:00:00Z",
        "version": reviewed["document_version"],
        "statements": [
            statement(bom, by_name[entry["component"]], entry)
            for entry in reviewed["statements"]
            if entry["component"] in by_name
        ],
    }
    # The same content has the same name.
    name = uuid.uuid5(uuid.NAMESPACE_OID, json.dumps(document, sort_keys=True))
    return {"@context": CONTEXT, "@id": f"urn:uuid:{name}", **document}


def main():
    bom, reviewed, out = map(pathlib.Path, sys.argv[1:])
    document = vex_document(json.loads(bom.read_text()), json.loads(reviewed.read_text()))
    out.write_text(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
