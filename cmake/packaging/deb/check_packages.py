#!/usr/bin/env python3
"""Fails unless the Debian packages in a folder hold what they are to hold.

check_packages.py PACKAGES LISTS LIBDIR CONFIGURATION API INSTALLED BACKEND...

What they depend on beside each other is looked for in dpkg's database, DPKG_ADMINDIR where that is
set. PACKAGES has the .deb files; LISTS, for each package, NAME.txt with its files, one a line,
below /usr, where @LIBDIR@ is the folder of libraries, @CONFIG@ the build's configuration, @API@ the
version of the C API, and a line that ends in /** names all that lies below; libdefrec1-plugin.txt
is the list of each backend's package, @BACKEND@ its name; INSTALLED is where `cmake --install` has
put everything.
"""
import collections
import pathlib
import re
import subprocess
import sys

# Files that a package alone has, and other installations have not.
PACKAGE_DOCS = re.compile(
    r"share/doc/[^/]+/(copyright|changelog\.Debian\.gz|bom(\.spdx)?\.json|notices\.txt)|share/lintian/overrides/[^/]+"
)


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


class Package:
    def __init__(self, deb):
        fields = run("dpkg-deb", "-f", str(deb))
        self.fields = dict(re.findall(r"^([A-Z][\w-]+): (.*)$", fields, re.MULTILINE))
        self.name = self.fields["Package"]
        # -rw-r--r-- root/root 123 2026-01-01 00:00 ./usr/include/defrec_c.h, with " -> target"
        # behind links
        self.entries = {}
        for line in run("dpkg-deb", "-c", str(deb)).splitlines():
            mode, owner, _, _, _, path = line.split(maxsplit=5)
            self.entries[path.split(" -> ")[0].removeprefix("./")] = (mode, owner)
        self.files = {path for path in self.entries if not path.endswith("/")}

    def depends(self):
        alternatives = self.fields.get("Depends", "").split(", ")
        return [
            re.match(r"([^ (]+)(?: \((\S+) (\S+)\))?", choice).groups()
            for choice in alternatives
            if choice
        ]


def check_files(package, listed):
    expected = [f"usr/{line}" for line in listed]
    whole = tuple(line.removesuffix("**") for line in expected if line.endswith("/**"))
    found = {path for path in package.files if not (whole and path.startswith(whole))}
    wanted = {line for line in expected if not line.endswith("/**")}
    assert (
        found == wanted
    ), f"{package.name}: not expected {sorted(found - wanted)}, missing {sorted(wanted - found)}"


def check_modes(package):
    for path, (mode, owner) in package.entries.items():
        assert owner == "root/root", f"{package.name}: {path} belongs to {owner}"
        executable = (
            path.startswith("usr/bin/")
            or path.endswith("/")
            or re.search(r"\.so(\.[0-9.]+)?$", path)
        )
        allowed = {
            "d": ["drwxr-xr-x"],
            "l": ["lrwxrwxrwx"],
            "-": ["-rwxr-xr-x", "-rw-r--r--"] if executable else ["-rw-r--r--"],
        }
        assert mode in allowed[mode[0]], f"{package.name}: {path} is {mode}"
        if path.startswith("usr/bin/") and path in package.files:
            assert mode == "-rwxr-xr-x", f"{package.name}: {path} is {mode}"


def check_depends(package, packages):
    has_binaries = any(
        re.search(r"^usr/(bin/|lib/.*\.so)", path) and mode.startswith("-")
        for path, (mode, _) in package.entries.items()
    )
    assert not has_binaries or "libc6" in {
        name for name, _, _ in package.depends()
    }, f"{package.name} does not depend on libc6"
    for name, relation, version in package.depends():
        if name in packages:
            assert (
                relation == "=" and version == packages[name].fields["Version"]
            ), f"{package.name} depends on {name} {relation} {version}"
        else:
            status = run("dpkg-query", "-W", "-f", "${db:Status-Status}", name)
            assert status == "installed", f"{package.name} depends on {name}, which is {status}"


def check_together(packages, installed):
    owners = collections.defaultdict(list)
    for package in packages.values():
        for path in package.files:
            owners[path.removeprefix("usr/")].append(package.name)
    twice = {path: names for path, names in owners.items() if len(names) > 1}
    assert not twice, f"in more than one package: {twice}"
    everything = {
        str(path.relative_to(installed))
        for path in installed.rglob("*")
        if path.is_symlink() or not path.is_dir()
    }
    packed = {path for path in owners if not PACKAGE_DOCS.fullmatch(path) or path in everything}
    assert packed == everything, (
        f"packed and not installed: {sorted(packed - everything)}; installed and in no package:"
        f" {sorted(everything - packed)}"
    )


def main():
    folder, lists, installed = (pathlib.Path(sys.argv[i]) for i in (1, 2, 6))
    replacements = {"@LIBDIR@": sys.argv[3], "@CONFIG@": sys.argv[4].lower(), "@API@": sys.argv[5]}
    packages = {package.name: package for package in map(Package, sorted(folder.glob("*.deb")))}
    for name, package in packages.items():
        stem, _, backend = name.partition("-plugin-")
        list_path = lists / (f"{stem}-plugin.txt" if backend else f"{name}.txt")
        values = {**replacements, "@BACKEND@": backend}
        listed = re.sub(r"@\w+@", lambda found: values[found[0]], list_path.read_text())
        check_files(package, listed.split())
        check_modes(package)
        check_depends(package, packages)
    recorded = {path.stem for path in lists.glob("*.txt")} - {"libdefrec1-plugin"}
    missing = (recorded | {f"libdefrec1-plugin-{backend}" for backend in sys.argv[7:]}) - set(
        packages
    )
    assert not missing, f"no package {missing}"
    check_together(packages, installed)
    print(
        f"{len(packages)} packages,"
        f" {sum(len(package.files) for package in packages.values())} files"
    )


if __name__ == "__main__":
    main()
