#!/usr/bin/env python3
"""Writes the component list (CycloneDX 1.5 and SPDX 2.3, JSON) and the notices of what is contained
in the binaries.

component_list.py FOUND.json --reviewed reviewed.json --list bom.json --spdx bom.spdx.json
    --notices notices.txt [--page package-lock.json --page-packages node_modules]
FOUND.json is what CMake found: our parts, and each component's name, version, licence, one of its
files, how it takes part and in which parts. Which Debian package a file belongs to, dpkg says here.
The page is the report of `defrec track`, bundled from npm packages.
"""
import argparse
import datetime
import functools
import json
import os
import pathlib
import platform
import subprocess
import urllib.parse
import uuid

from spdx import spdx_document

PAGE_PART = "defrec"
TYPES = {"linked": "library", "contained": "library", "tool": "application"}


@functools.lru_cache(maxsize=None)
def debian_package(file, sysroot):
    """Name, version, architecture and source of a file's package; None if it has none. A file below
    the sysroot is of a package there."""
    path = os.path.realpath(file)
    query = ["dpkg-query"]
    if sysroot and path.startswith(f"{os.path.realpath(sysroot)}/"):
        path = path.removeprefix(os.path.realpath(sysroot))
        file = file.removeprefix(sysroot)
        query.append(f"--admindir={sysroot}/var/lib/dpkg")
    # Files of /lib are known by that name although /lib is a link to /usr/lib.
    for candidate in (file, path, path.removeprefix("/usr")):
        try:
            found = subprocess.run([*query, "-S", candidate], capture_output=True, text=True)
        except FileNotFoundError:
            return None
        if found.returncode == 0:
            name = found.stdout.partition(": ")[0].split(",")[0]
            fields = "${Package}\t${Version}\t${Architecture}\t${source:Package}"
            return subprocess.run(
                [*query, "-W", "-f", fields, name], capture_output=True, text=True, check=True
            ).stdout.split("\t")
    return None


def distribution():
    try:
        release = platform.freedesktop_os_release()
    except OSError:
        return "debian", None
    return (
        release["ID"],
        f"{release['ID']}-{release['VERSION_ID']}" if "VERSION_ID" in release else None,
    )


def package_url(component):
    package = debian_package(component["file"], component["sysroot"])
    if package is None:
        return f"pkg:generic/{component['name']}@{component['version']}"
    name, version, architecture, source = package
    vendor, release = distribution()
    qualifiers = {"arch": architecture, "distro": release, "upstream": source}
    query = "&".join(
        f"{key}={urllib.parse.quote(value)}" for key, value in qualifiers.items() if value
    )
    name, version = urllib.parse.quote(name), urllib.parse.quote(version, safe="~")
    return f"pkg:deb/{vendor}/{name}@{version}?{query}"


def licence_entry(licence):
    if " " in licence:
        return {"expression": licence}
    return {"license": {"name" if licence.startswith("LicenseRef-") else "id": licence}}


def support(component, purl, reviewed):
    """Until when the supplier supports it. Dates of Debian 12 are for its packages and for
    libraries that were built from its sources, which are of no package."""
    for name, group in reviewed["support"].items():
        other = purl.startswith("pkg:deb/") and f"distro={name}" not in purl
        if component["name"] in group["components"] and not (name == "debian-12" and other):
            return {
                "defrec:supplier": group["supplier"],
                "defrec:security_support_until": group["security_support_until"] or "not published",
                "defrec:end_of_support": group["end_of_support"] or "not published",
            }
    return {"defrec:end_of_support": "not known"}


def entry(component, reviewed):
    purl = component.get("purl") or package_url(component)
    return {
        "type": TYPES[component["how"]],
        "bom-ref": component["ref"],
        "name": component["name"],
        "version": component["version"],
        "scope": "excluded" if component["how"] == "tool" else "required",
        "licenses": [licence_entry(component["licence"])],
        "purl": purl,
        "properties": [
            {"name": name, "value": value}
            for name, value in {
                "defrec:how": component["how"],
                **support(component, purl, reviewed),
            }.items()
        ],
    }


def own_entry(part, version):
    return {
        "type": "library" if part.startswith(("lib", "defrec_plugin_")) else "application",
        "bom-ref": part,
        "group": "defrec",
        "name": part,
        "version": version,
        "scope": "required",
        "licenses": [licence_entry("Apache-2.0")],
        "purl": f"pkg:generic/{part}@{version}",
    }


def page_components(lock, packages):
    """What the page is bundled from, and what with, as npm's lock file has it."""
    locked = json.loads(pathlib.Path(lock).read_text())["packages"]
    root = locked[""]
    for kind, how in (("dependencies", "contained"), ("devDependencies", "tool")):
        for name in root.get(kind, {}):
            package = locked[f"node_modules/{name}"]
            yield {
                "name": name,
                "version": package["version"],
                "licence": package["license"],
                "how": how,
                "used_by": [PAGE_PART],
                "purl": f"pkg:npm/{name}@{package['version']}",
                "licence_file": os.path.join(packages, name, "LICENSE"),
            }


def timestamp():
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    utc = datetime.timezone.utc
    moment = (
        datetime.datetime.fromtimestamp(int(epoch), utc) if epoch else datetime.datetime.now(utc)
    )
    return moment.strftime("%Y-%m-%dT%H:%M:%SZ")


def component_list(parts, version, components, reviewed):
    bom = {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {
            "component": {
                "type": "framework",
                "bom-ref": "sdk",
                "name": "defrec",
                "version": version,
                "licenses": [licence_entry("Apache-2.0")],
                "purl": f"pkg:generic/defrec@{version}",
            },
        },
        "components": [own_entry(part, version) for part in parts]
        + [entry(component, reviewed) for component in components],
        "dependencies": (
            [{"ref": "sdk", "dependsOn": parts}]
            + [
                {"ref": part, "dependsOn": [c["ref"] for c in components if part in c["used_by"]]}
                for part in parts
            ]
            + [{"ref": component["ref"]} for component in components]
        ),
    }
    # The same content has the same number.
    serial = uuid.uuid5(uuid.NAMESPACE_OID, json.dumps(bom, sort_keys=True))
    bom["metadata"]["timestamp"] = timestamp()
    return {"serialNumber": f"urn:uuid:{serial}", **bom}


def licence_text(component):
    if "licence_file" in component:
        return pathlib.Path(component["licence_file"]).read_text()
    package = debian_package(component["file"], component["sysroot"])
    if package is None:
        # The file may come from a prefix of scripts/make_static_libraries.sh.
        for folder in pathlib.Path(component["file"]).parents:
            copyright_file = folder / "share" / "doc" / component["name"] / "copyright"
            if copyright_file.is_file():
                return copyright_file.read_text()
        return f"Licence: {component['licence']}\n"
    below = component["sysroot"] if component["file"].startswith(f"{component['sysroot']}/") else ""
    return pathlib.Path(f"{below}/usr/share/doc/{package[0]}/copyright").read_text()


def notices(components):
    line = "=" * 100
    texts = ["What defrec's binaries contain of others, and under which licences.\n"]
    for component in components:
        if component["how"] == "contained":
            head = (
                f"{component['name']} {component['version']}, in {', '.join(component['used_by'])}"
            )
            texts.append(f"{line}\n{head}\n{line}\n{licence_text(component).strip()}\n")
    return "\n".join(texts)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("found")
    parser.add_argument("--reviewed", required=True)
    parser.add_argument("--list", required=True)
    parser.add_argument("--spdx", required=True)
    parser.add_argument("--notices", required=True)
    parser.add_argument("--page")
    parser.add_argument("--page-packages")
    arguments = parser.parse_args()
    found = json.loads(pathlib.Path(arguments.found).read_text())
    components = found["components"]
    if arguments.page and os.path.isdir(arguments.page_packages):
        components += page_components(arguments.page, arguments.page_packages)
    for component in components:
        component["ref"] = f"{component['name']}@{component['version']}"
        component["sysroot"] = found["sysroot"]
    reviewed = json.loads(pathlib.Path(arguments.reviewed).read_text())
    bom = component_list(found["parts"], found["version"], components, reviewed)
    pathlib.Path(arguments.list).write_text(json.dumps(bom, indent=2) + "\n")
    texts = {
        component["licence"]: licence_text(component)
        for component in components
        if component["licence"].startswith("LicenseRef-")
    }
    pathlib.Path(arguments.spdx).write_text(json.dumps(spdx_document(bom, texts), indent=2) + "\n")
    pathlib.Path(arguments.notices).write_text(notices(components))


if __name__ == "__main__":
    main()
