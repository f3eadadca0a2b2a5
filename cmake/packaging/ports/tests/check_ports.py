#!/usr/bin/env python3
"""Fails unless vcpkg's port and Conan's recipe name the project's version, and require what the
build looks for:
check_ports.py PROJECT_VERSION VCPKG_JSON TRACE REQUIRED

TRACE is what CMake did when it configured the port (run_port.cmake), REQUIRED what the recipe
requires, its own reference first (run_recipe.py).
"""
import json
import pathlib
import sys

# What is looked for, and what provides it in vcpkg and in Conan; nothing where the system, or in
# vcpkg the build, provides it.
PROVIDERS = {
    "ccache": (None, None),
    "Threads": (None, None),
    "PkgConfig": (None, None),
    "Eigen3": ("eigen3", "eigen"),
    "yaml-cpp": ("yaml-cpp", "yaml-cpp"),
    "libhwy": ("highway", "highway"),
    "glslangValidator": ("glslang", None),
    "spirv-val": ("spirv-tools", None),
    "volk.h": ("volk", None),
    "vulkan/vulkan_core.h": ("vulkan-headers", None),
}
LOOKING = {
    "find_package": 0,
    "pkg_check_modules": -1,
    "find_path": 1,
    "find_file": 1,
    "find_library": 1,
    "find_program": 1,
}


def looked_for(trace, root):
    found = set()
    for line in trace.read_text().splitlines():
        entry = json.loads(line)
        if entry.get("cmd") in LOOKING and pathlib.Path(entry["file"]).is_relative_to(root):
            arguments = [argument for argument in entry["args"] if argument != "REQUIRED"]
            found.add(arguments[LOOKING[entry["cmd"]]])
    return found


def main():
    version = sys.argv[1]
    manifest, trace, required = (pathlib.Path(argument) for argument in sys.argv[2:])
    port = json.loads(manifest.read_text())
    assert (
        port["version"] == version
    ), f"{manifest} has version {port['version']}, CMakeLists.txt {version}"
    dependencies = list(port["dependencies"])
    for feature in port["default-features"]:
        dependencies += port["features"][feature]["dependencies"]
    ported = {entry if isinstance(entry, str) else entry["name"] for entry in dependencies}
    reference, *references = required.read_text().split()
    assert reference == f"defrec/{version}", reference
    names = looked_for(trace, manifest.resolve().parents[5])
    assert names == set(PROVIDERS), (
        f"looked for and not listed here: {names - set(PROVIDERS)}, or the other way round:"
        f" {set(PROVIDERS) - names}"
    )
    expected = {PROVIDERS[name][0] for name in names} - {None} | {
        "vcpkg-cmake",
        "vcpkg-cmake-config",
    }
    assert ported == expected, f"vcpkg.json: {ported ^ expected}"
    recipes = {reference.partition("/")[0] for reference in references}
    expected = {PROVIDERS[name][1] for name in names} - {None}
    assert recipes == expected, f"conanfile.py: {recipes ^ expected}"


if __name__ == "__main__":
    main()
