#!/usr/bin/env python3
"""Fails where the build of a binary read a header, or linked an archive, that is of no component
which the list has for this binary, and where the list has a component of which it read nothing;
then does the same to lists that leave one out or have one more, and to a build with planted
components, which have to be found.

check_inputs.py bom.json found.json BUILD SOURCE [package-lock.json]
The lock file is that of the report's page, whose packages have to be listed as well.
"""
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import urllib.parse

from build_inputs import Build, packages_of, root_of
from check_component_list import binary_of, qualifiers

# Headers of the kernel give the C library its numbers and structures; nothing of them is in a
# binary.
OF_THE_SYSTEM = {"linux"}
# Files that the compiler adds to each link beside the shared libraries that the list names:
# beginnings and ends of programs, arithmetic, and archives that are empty since glibc 2.34.
OF_THE_COMPILER = re.compile(
    r"crt\w+\.o|[Sg]crt1\.o|libgcc(_eh)?\.a|libc_nonshared\.a|lib(rt|pthread|dl)\.a"
)


class List:
    """A binary's components: source packages, and folders where they have none."""

    def __init__(self, bom, found, part):
        uses = uses_of(bom, part)
        listed = [component for component in bom["components"] if component["bom-ref"] in uses]
        files = {component["name"]: component["file"] for component in found["components"]}
        self.sources, self.contained, self.roots = set(), set(), set()
        for component in listed:
            upstream = qualifiers(component).get("upstream")
            if upstream is not None:
                self.sources.add(upstream)
                if component["properties"][0]["value"] == "contained":
                    self.contained.add(upstream)
            elif component["name"] in files:
                self.roots.add(root_of(files[component["name"]]))

    def fault_of(self, path, how, package):
        """A fault of the list about a file; empty: none."""
        if package is None:
            has_root = any(root and pathlib.Path(path).is_relative_to(root) for root in self.roots)
            return "" if has_root else "is of no package, and of no component of the list"
        source = package[1]
        if source in OF_THE_SYSTEM and how == "read":
            return ""
        if source not in self.sources:
            return f"is of {source}, which the list does not have"
        is_code = how == "linked" and path.endswith((".a", ".o"))
        if is_code and source not in self.contained:
            if not OF_THE_COMPILER.fullmatch(os.path.basename(path)):
                return f"is in the binary, and the list does not say that {source} is contained"
        return ""


def faults_of(inputs, owners, listed):
    faults = {path: listed.fault_of(path, how, owners.get(path)) for path, how in inputs.items()}
    return {path: fault for path, fault in faults.items() if fault}


def is_of_binary(component):
    """Whether a binary links or contains it. What the page is bundled from is in the lock file."""
    how = {entry["name"]: entry["value"] for entry in component["properties"]}["defrec:how"]
    return how in ("linked", "contained") and not component["purl"].startswith("pkg:npm/")


def uses_of(bom, part):
    (entry,) = (entry for entry in bom["dependencies"] if entry["ref"] == part)
    return entry.get("dependsOn", [])


def idle(bom, found, part, inputs, owners):
    """Components that the binary is said to link or contain, and of which its build read
    nothing."""
    files = {component["name"]: component["file"] for component in found["components"]}
    sources = {owners[path][1] for path in inputs if path in owners}
    by_ref = {component["bom-ref"]: component for component in bom["components"]}

    def is_read(component):
        upstream = qualifiers(component).get("upstream")
        if upstream is not None:
            return upstream in sources
        root = root_of(files[component["name"]])
        return root is not None and any(pathlib.Path(path).is_relative_to(root) for path in inputs)

    listed = filter(is_of_binary, (by_ref[ref] for ref in uses_of(bom, part)))
    return sorted(component["bom-ref"] for component in listed if not is_read(component))


def with_uses(bom, part, uses):
    """The list as if the binary used these components."""
    entries = [
        {**entry, "dependsOn": uses} if entry["ref"] == part else entry
        for entry in bom["dependencies"]
    ]
    return {**bom, "dependencies": entries}


def check_added(bom, found, part, inputs, owners):
    """A list with one more component, of which the build read nothing, fails. Returns how many
    were added."""
    uses = uses_of(bom, part)
    files = {component["name"] for component in found["components"]}
    read = {owners[path][1] for path in inputs if path in owners}
    added = 0
    for component in bom["components"]:
        ref, source = component["bom-ref"], qualifiers(component).get("upstream")
        is_known = component["name"] in files and is_of_binary(component)
        if not is_known or ref in uses or source is None or source in read:
            continue
        if idle(with_uses(bom, part, [*uses, ref]), found, part, inputs, owners) != [ref]:
            raise SystemExit(f"not found: {part} with {ref}")
        added += 1
    return added


def check_hidden(bom, found, part, inputs, owners):
    """A list without a component of which the build read something fails. Returns how many were
    left out."""
    uses = uses_of(bom, part)
    by_ref = {component["bom-ref"]: component for component in bom["components"]}
    read = {owners[path][1] for path in inputs if path in owners}
    tried = 0
    for ref in uses:
        source = qualifiers(by_ref[ref]).get("upstream")
        shared = [other for other in uses if qualifiers(by_ref[other]).get("upstream") == source]
        if source not in read or len(shared) > 1:
            continue  # not read, or another component of the list stands for it
        without = with_uses(bom, part, [other for other in uses if other != ref])
        if not faults_of(inputs, owners, List(without, found, part)):
            raise SystemExit(f"not found: {part} without {ref}")
        tried += 1
    return tried


PLANTED = """rule compile
  command = c++ -MD -MF $out.d -I{foreign} -I{fetched} -c $in -o $out
  depfile = $out.d
  deps = gcc
rule archive
  command = ar qc $out $in
rule link
  command = : && c++ -o $out $in -L{foreign} -lplanted && :
build main.o: compile {source}/main.cpp
build own.o: compile {source}/own.cpp
build libown.a: archive own.o
build program: link main.o libown.a
"""


def check_planted(bom, found, part):
    """A header, an archive and a fetched header that nobody declares are found in a build that has
    them, also where only an archive of ours uses one."""
    with tempfile.TemporaryDirectory() as scratch:
        work = pathlib.Path(os.path.realpath(scratch))
        folders = {name: work / name for name in ("foreign", "source", "build")}
        folders["fetched"] = folders["build"] / "_deps" / "fetched"
        for folder in folders.values():
            folder.mkdir(parents=True, exist_ok=True)
        texts = {
            folders["foreign"] / "planted.h": "int planted();\n",
            folders["foreign"] / "planted.cpp": "int planted() { return 0; }\n",
            folders["fetched"] / "fetched.h": "inline int fetched() { return 0; }\n",
            folders["source"] / "own.h": "int own();\n",
            folders["source"] / "own.cpp": '#include "own.h"\n#include "fetched.h"\n'
            "int own() { return fetched(); }\n",
            folders["source"] / "main.cpp": '#include "own.h"\n#include "planted.h"\n'
            "int main() { return own() + planted(); }\n",
            folders["build"] / "build.ninja": PLANTED.format(**folders),
        }
        for path, text in texts.items():
            path.write_text(text)
        foreign = folders["foreign"]
        for command in (
            ["c++", "-c", "planted.cpp", "-o", "planted.o"],
            ["ar", "qc", "libplanted.a", "planted.o"],
        ):
            subprocess.run(command, cwd=foreign, check=True)
        subprocess.run(
            ["ninja", "-C", str(folders["build"])], check=True, stdout=subprocess.DEVNULL
        )
        inputs = Build(folders["build"], folders["source"]).foreign_inputs("program")
        faults = faults_of(inputs, packages_of(inputs), List(bom, found, part))
        expected = {
            str(foreign / "planted.h"),
            str(foreign / "libplanted.a"),
            str(folders["fetched"] / "fetched.h"),
        }
        assert set(faults) == expected, f"planted {expected}, found {faults}"


def check_page(bom, lock):
    """Each package that the page is bundled from, also one that another brings, is listed."""
    listed = {component["purl"] for component in bom["components"]}
    for name, package in json.loads(pathlib.Path(lock).read_text())["packages"].items():
        if name and not package.get("dev"):
            purl = f"pkg:npm/{name.rpartition('node_modules/')[2]}@{package['version']}"
            assert urllib.parse.unquote(purl) in listed, f"{purl} is not listed"


def main():
    bom, found = (json.loads(pathlib.Path(path).read_text()) for path in sys.argv[1:3])
    build = Build(*sys.argv[3:5])
    parts = bom["dependencies"][0]["dependsOn"]
    files = left_out = added = 0
    for part in parts:
        binary = binary_of(part, build.folder / "lib", build.folder / "bin").resolve()
        inputs = build.foreign_inputs(str(binary.relative_to(build.folder)))
        owners = packages_of(inputs)
        faults = faults_of(inputs, owners, List(bom, found, part))
        assert not faults, f"{part}: " + "; ".join(f"{path} {why}" for path, why in faults.items())
        unused = idle(bom, found, part, inputs, owners)
        assert not unused, f"{part}: its build read nothing of {', '.join(unused)}"
        left_out += check_hidden(bom, found, part, inputs, owners)
        added += check_added(bom, found, part, inputs, owners)
        files += len(inputs)
    assert left_out > len(parts), f"only {left_out} components were left out"
    assert added > len(parts), f"only {added} components were added"
    check_planted(bom, found, parts[0])
    for lock in sys.argv[5:]:
        check_page(bom, lock)
    print(
        f"{files} files that {len(parts)} binaries were built from are accounted for; "
        f"{left_out} lists without a component and {added} with one more were refused"
    )


if __name__ == "__main__":
    main()
