#!/usr/bin/env bash
# Builds the libraries that a build for Windows links, from Debian's source packages, into a folder:
# a prefix for cmake/toolchains/x86_64-w64-mingw32.cmake. Wants g++-mingw-w64-x86-64-posix and what
# debian_sources.sh does.
#   scripts/make_windows_prefix.sh FOLDER
set -euo pipefail
[ $# = 1 ] || {
    echo "usage: scripts/make_windows_prefix.sh FOLDER" >&2
    exit 2
}
source "$(dirname "${BASH_SOURCE[0]}")/debian_sources.sh"
mkdir -p "$1"
prefix="$(cd "$1" && pwd)"
[ -z "$(ls -A "$prefix")" ] || {
    echo "$prefix is not empty" >&2
    exit 2
}
project="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
toolchain="$project/cmake/toolchains/x86_64-w64-mingw32.cmake"

state="$(mktemp -d)"
trap 'rm -rf "$state"' EXIT
open_debian "$state"

# Headers, volk, which is one as well, and zlib, which Debian has for MinGW-w64.
(cd "$state/archives" && "${apt[@]}" download libeigen3-dev doctest-dev libcli11-dev \
    nlohmann-json3-dev libvulkan-dev libvulkan-volk-dev libz-mingw-w64-dev)
for deb in "$state"/archives/*.deb; do
    dpkg-deb --fsys-tarfile "$deb" | tar -x --no-same-owner -C "$prefix"
done
# doctest's is made for /usr alone.
sed -i "s|_IMPORT_PREFIX \"/usr\"|_IMPORT_PREFIX \"$prefix/usr\"|" \
    "$prefix/usr/lib/cmake/doctest/doctestTargets.cmake"

for package in yaml-cpp libpng1.6 highway; do
    build_static "$state" "$package" "$prefix/usr/x86_64-w64-mingw32" "$prefix/usr/share/doc" \
        --toolchain "$toolchain" "-DDEFREC_WINDOWS_PREFIX=$prefix"
done
echo "$prefix: libraries for 64-bit Windows"
