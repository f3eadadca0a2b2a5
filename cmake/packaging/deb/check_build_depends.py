#!/usr/bin/env python3
"""Fails unless Build-Depends of debian/control names what a build needs. check_build_depends.py
CONTROL INSTALL_PACKAGES_SH"""
import re
import subprocess
import sys

ALWAYS_THERE = {"g++"}  # build-essential, which Debian's builds need not name
OF_THE_PACKAGING = {"debhelper-compat"}


def main():
    control, install = sys.argv[1:]
    listed = re.search(r"^Build-Depends:((?:.|\n )*)", open(control).read(), re.MULTILINE).group(1)
    depends = {entry.split()[0] for entry in listed.split(",")} - OF_THE_PACKAGING
    needed = (
        set(
            subprocess.run(
                [install, "list"], capture_output=True, text=True, check=True
            ).stdout.split()
        )
        - ALWAYS_THERE
    )
    assert (
        depends == needed
    ), f"debian/control lacks {sorted(needed - depends)} and has besides {sorted(depends - needed)}"
    print(f"{len(depends)} packages")


if __name__ == "__main__":
    main()
