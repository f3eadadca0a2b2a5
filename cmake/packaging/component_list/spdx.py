"""The component list as SPDX 2.3, made from the one in CycloneDX: the same components, versions,
licences, package URLs and dependencies."""
import re

# How a component takes part in one of our binaries: the relationship, and whether it begins at the
# binary.
RELATIONSHIPS = {
    "linked": ("DYNAMIC_LINK", True),
    "contained": ("CONTAINS", True),
    "tool": ("BUILD_TOOL_OF", False),
}
PURPOSES = {"application": "APPLICATION", "framework": "FRAMEWORK", "library": "LIBRARY"}


def identifier(ref):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", ref)


def licence_of(component):
    (entry,) = component["licenses"]
    return (
        entry["expression"]
        if "expression" in entry
        else entry["license"].get("id") or entry["license"]["name"]
    )


def end_of_support(component):
    """As SPDX has it, where the supplier has published a date."""
    for entry in component.get("properties", []):
        if entry["name"] == "defrec:end_of_support" and re.match("[0-9]", entry["value"]):
            return {"validUntilDate": f"{entry['value']}T00:00:00Z"}
    return {}


def package(component):
    return {
        "SPDXID": identifier(component["bom-ref"]),
        "name": component["name"],
        "versionInfo": component["version"],
        "primaryPackagePurpose": PURPOSES[component["type"]],
        "downloadLocation": "NOASSERTION",
        "filesAnalyzed": False,
        "licenseConcluded": licence_of(component),
        "licenseDeclared": licence_of(component),
        "copyrightText": "NOASSERTION",
        "externalRefs": [
            {
                "referenceCategory": "PACKAGE-MANAGER",
                "referenceType": "purl",
                "referenceLocator": component["purl"],
            }
        ],
        **end_of_support(component),
    }


def relationships(bom):
    sdk = bom["metadata"]["component"]["bom-ref"]
    how = {
        component["bom-ref"]: component["properties"][0]["value"]
        for component in bom["components"]
        if "properties" in component
    }
    yield "SPDXRef-DOCUMENT", "DESCRIBES", identifier(sdk)
    for dependency in bom["dependencies"]:
        for target in dependency.get("dependsOn", []):
            kind, begins_here = (
                ("CONTAINS", True) if dependency["ref"] == sdk else RELATIONSHIPS[how[target]]
            )
            ends = identifier(dependency["ref"]), identifier(target)
            yield (ends[0], kind, ends[1]) if begins_here else (ends[1], kind, ends[0])


def spdx_document(bom, texts):
    """texts: of licences that SPDX has no identifier for, by their names (LicenseRef-...)."""
    sdk = bom["metadata"]["component"]
    name = f"{sdk['name']}-{sdk['version']}"
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": name,
        "documentNamespace": (
            f"https://spdx.org/spdxdocs/{name}-{bom['serialNumber'].rpartition(':')[2]}"
        ),
        "creationInfo": {
            "created": bom["metadata"]["timestamp"],
            "creators": ["Organization: the defrec developers", "Tool: component_list.py"],
        },
        "packages": [package(component) for component in [sdk, *bom["components"]]],
        "relationships": [
            {"spdxElementId": begin, "relationshipType": kind, "relatedSpdxElement": end}
            for begin, kind, end in relationships(bom)
        ],
    }
    if texts:
        document["hasExtractedLicensingInfos"] = [
            {"licenseId": licence, "extractedText": text} for licence, text in sorted(texts.items())
        ]
    return document
