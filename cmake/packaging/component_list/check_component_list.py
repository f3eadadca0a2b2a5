#!/usr/bin/env python3
"""Fails unless the component lists are well formed, agree and say what the binaries link.

check_component_list.py bom.json SCHEMA bom.spdx.json SCHEMA FOLDER_OF_LIBRARIES FOLDER_OF_PROGRAMS
"""
import functools
import json
import pathlib
import re
import subprocess
import sys
import urllib.parse

import jsonschema


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def qualifiers(component):
    return dict(urllib.parse.parse_qsl(component.get("purl", "").partition("?")[2]))


def binary_of(part, libraries, programs):
    candidates = [
        libraries / f"{part}.so",
        libraries / "defrec-conformance" / f"{part}.so",
        programs / part,
    ]
    found = [path for path in candidates if path.exists()]
    assert found, f"{part} is listed, and there is none of {candidates}"
    return found[0]


@functools.lru_cache(maxsize=None)
def source_package(library):
    """The Debian source package of a shared library that the loader maps."""
    path = str(pathlib.Path(library).resolve())
    for candidate in (library, path, path.removeprefix("/usr")):
        found = subprocess.run(["dpkg-query", "-S", candidate], capture_output=True, text=True)
        if found.returncode == 0:
            return run(
                "dpkg-query",
                "-W",
                "-f",
                "${source:Package}",
                found.stdout.partition(": ")[0].split(",")[0],
            )
    return None


def linked_sources(binary):
    """Source packages of the libraries that the binary names itself, not of those that these
    need."""
    needed = re.findall(r"NEEDED +(\S+)", run("objdump", "-p", str(binary)))
    mapped = dict(re.findall(r"(\S+) => (/\S+)", run("ldd", str(binary))))
    return {
        name: source_package(mapped[name])
        for name in needed
        if name in mapped and not name.startswith("libdefrec.")
    }


def check_references(bom):
    components = bom["components"]
    refs = [component["bom-ref"] for component in components] + [
        bom["metadata"]["component"]["bom-ref"]
    ]
    assert len(set(refs)) == len(refs), "a bom-ref is used twice"
    edges = {
        dependency["ref"]: dependency.get("dependsOn", []) for dependency in bom["dependencies"]
    }
    assert set(edges) == set(
        refs
    ), f"dependencies are not those of the components: {set(edges) ^ set(refs)}"
    assert len(edges) == len(bom["dependencies"]), "a component has its dependencies twice"
    named = {ref for targets in edges.values() for ref in targets}
    assert named <= set(refs), f"dependencies on what is not listed: {named - set(refs)}"
    unused = set(refs) - named - {bom["metadata"]["component"]["bom-ref"]}
    assert not unused, f"nothing uses {unused}"
    return edges


def check_linked(bom, edges, libraries, programs):
    by_ref = {component["bom-ref"]: component for component in bom["components"]}
    checked = 0
    for part in edges[bom["metadata"]["component"]["bom-ref"]]:
        # The compiler and its libraries come from one source: a tool stands for no library.
        listed = {
            qualifiers(by_ref[ref]).get("upstream")
            for ref in edges[part]
            if by_ref[ref]["scope"] == "required"
        }
        for library, source in linked_sources(binary_of(part, libraries, programs)).items():
            # libgcc_s and libstdc++ come from one source; the list names both by libstdc++.
            assert (
                source in listed
            ), f"{part} links {library} (source package {source}), and the list does not say so"
            checked += 1
    assert checked > 0, "no linked library was looked at"
    return checked


def check_versions(bom):
    """What is in the binaries has the version of the Debian package that it is said to come
    from."""
    for component in bom["components"]:
        purl = component.get("purl", "")
        if component["scope"] == "required" and purl.startswith("pkg:deb/"):
            installed = urllib.parse.unquote(purl.partition("@")[2].partition("?")[0])
            assert (
                component["version"] in installed
            ), f"{component['name']} {component['version']}, from package version {installed}"


def check_support(bom, spdx):
    """Each component says until when it is supported, and SPDX says the same date."""
    dates = {package["name"]: package.get("validUntilDate", "") for package in spdx["packages"]}
    for component in bom["components"]:
        if component.get("group") == "defrec":
            continue
        properties = {entry["name"]: entry["value"] for entry in component["properties"]}
        end = properties.get("defrec:end_of_support", "not known")
        assert end != "not known", f"{component['name']}: end of support is not known"
        assert dates[component["name"]][:10] == (end if end[0].isdigit() else ""), component["name"]


def check_planted(bom, edges, libraries, programs):
    """The list without a library that a binary links fails."""
    sdk = bom["metadata"]["component"]["bom-ref"]
    part = edges[sdk][0]
    by_ref = {component["bom-ref"]: component for component in bom["components"]}
    linked = [ref for ref in edges[part] if by_ref[ref]["properties"][0]["value"] == "linked"]
    assert linked, f"{part} links nothing"
    for hidden in linked:
        without = {**edges, part: [ref for ref in edges[part] if ref != hidden]}
        try:
            check_linked(bom, without, libraries, programs)
        except AssertionError:
            continue
        raise SystemExit(f"not found: {part} links {hidden}, and the list does not say so")


def licences(component):
    return [
        entry.get("expression") or entry["license"].get("id") or entry["license"]["name"]
        for entry in component["licenses"]
    ]


def check_spdx(bom, edges, spdx):
    """The list in SPDX names the same components and the same uses."""
    expected = sorted(
        [c["name"], c["version"], c["purl"], *licences(c)]
        for c in [bom["metadata"]["component"], *bom["components"]]
    )
    packages = spdx["packages"]
    found = sorted(
        [
            p["name"],
            p["versionInfo"],
            p["externalRefs"][0]["referenceLocator"],
            p["licenseDeclared"],
        ]
        for p in packages
    )
    assert found == expected, f"SPDX lists {found}, CycloneDX {expected}"
    identifiers = [package["SPDXID"] for package in packages] + [spdx["SPDXID"]]
    assert len(set(identifiers)) == len(identifiers), "an SPDXID is used twice"
    ends = [
        relation[end]
        for relation in spdx["relationships"]
        for end in ("spdxElementId", "relatedSpdxElement")
    ]
    assert set(ends) <= set(
        identifiers
    ), f"relationships with what is not listed: {set(ends) - set(identifiers)}"
    uses = sum(len(targets) for targets in edges.values())
    assert (
        len(spdx["relationships"]) == uses + 1
    ), f"{len(spdx['relationships'])} relationships for {uses} uses and the document's"
    named = {
        licence
        for package in packages
        for licence in re.findall(r"LicenseRef-[\w.-]+", package["licenseDeclared"])
    }
    explained = {entry["licenseId"] for entry in spdx.get("hasExtractedLicensingInfos", [])}
    assert (
        named == explained
    ), f"licences without a text, or texts without a use: {named ^ explained}"


def main():
    list_path, schema_path, spdx_path, spdx_schema_path, libraries, programs = map(
        pathlib.Path, sys.argv[1:]
    )
    bom, spdx = json.loads(list_path.read_text()), json.loads(spdx_path.read_text())
    jsonschema.validate(bom, json.loads(schema_path.read_text()))
    jsonschema.validate(spdx, json.loads(spdx_schema_path.read_text()))
    edges = check_references(bom)
    check_spdx(bom, edges, spdx)
    check_versions(bom)
    check_support(bom, spdx)
    check_planted(bom, edges, libraries, programs)
    checked = check_linked(bom, edges, libraries, programs)
    print(f"{len(bom['components'])} components, {checked} linked libraries accounted for")


if __name__ == "__main__":
    main()
