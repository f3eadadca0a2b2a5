#!/usr/bin/env python3
"""Prints the platform of a wheel's tag, for the libraries in it: wheel_platform.py PROCESSOR
OBJDUMP LIBRARY...

It is manylinux_2_<minor>_<processor> where they need nothing but what every Linux with that glibc
has (PEP 600): glibc, and the libstdc++ and libgcc_s of a compiler of its time. Where they need more
it is linux_<processor>, a system like the one that built them.
"""
import re
import subprocess
import sys

EVERYWHERE = {
    "libc",
    "libm",
    "libdl",
    "libpthread",
    "librt",
    "libgcc_s",
    "libstdc++",
    "ld-linux-x86-64",
    "ld-linux-aarch64",
}
# The first glibc with which distributions have libstdc++ of that version.
LIBSTDCXX = {
    "GLIBCXX": [
        ((3, 4, 19), 17),
        ((3, 4, 22), 24),
        ((3, 4, 24), 28),
        ((3, 4, 28), 31),
        ((3, 4, 29), 34),
        ((3, 4, 30), 35),
    ],
    "CXXABI": [
        ((1, 3, 7), 17),
        ((1, 3, 10), 24),
        ((1, 3, 11), 28),
        ((1, 3, 12), 31),
        ((1, 3, 13), 34),
    ],
    "GCC": [((4, 8, 0), 17), ((7, 0, 0), 28)],
}


def glibc_minor(symbols):
    """That of the first glibc 2 that goes with a version of symbols, GLIBC_2.14 or GLIBCXX_3.4.30;
    None where none is known to."""
    name, _, numbers = symbols.partition("_")
    if not re.fullmatch(r"[0-9]+(\.[0-9]+)*", numbers):
        return None
    version = tuple(int(number) for number in numbers.split("."))
    if name == "GLIBC":
        return version[1] if version[0] == 2 else None
    return next((minor for last, minor in LIBSTDCXX.get(name, []) if version <= last), None)


def platform(processor, dumps):
    """The platform tag, from what `objdump -p` prints of each library."""
    least = 17
    for dump in dumps:
        needed = re.findall(r"^ +NEEDED +(\S+)", dump, re.MULTILINE)
        if any(library.partition(".so")[0] not in EVERYWHERE for library in needed):
            return f"linux_{processor}"
        for symbols in re.findall(r"^ +0x\w+ 0x\w+ \d+ (\S+)$", dump, re.MULTILINE):
            minor = glibc_minor(symbols)
            if minor is None:
                return f"linux_{processor}"
            least = max(least, minor)
    return f"manylinux_2_{least}_{processor}"


def main():
    processor, objdump, *libraries = sys.argv[1:]
    dumps = [
        subprocess.run([objdump, "-p", library], capture_output=True, text=True, check=True).stdout
        for library in libraries
    ]
    print(platform(processor, dumps))


if __name__ == "__main__":
    main()
