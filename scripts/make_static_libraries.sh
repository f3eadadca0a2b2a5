#!/usr/bin/env bash
# Builds the libraries that libdefrec and the cpu plugin link, static, from Debian's source
# packages, into a folder for CMAKE_PREFIX_PATH: a wheel with these inside runs where Debian's
# libraries are not. Wants a compiler and what debian_sources.sh does.
#   scripts/make_static_libraries.sh FOLDER [CMAKE-ARGUMENT...]
# For another machine FOLDER lies below the sysroot, and the arguments name the toolchain.
set -euo pipefail
[ $# -ge 1 ] || {
    echo "usage: scripts/make_static_libraries.sh FOLDER [CMAKE-ARGUMENT...]" >&2
    exit 2
}
source "$(dirname "${BASH_SOURCE[0]}")/debian_sources.sh"
mkdir -p "$1"
prefix="$(cd "$1" && pwd)"
shift
[ -z "$(ls -A "$prefix")" ] || {
    echo "$prefix is not empty" >&2
    exit 2
}

state="$(mktemp -d)"
trap 'rm -rf "$state"' EXIT
open_debian "$state"
for package in yaml-cpp highway; do
    build_static "$state" "$package" "$prefix" "$prefix/share/doc" \
        -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DCMAKE_CXX_VISIBILITY_PRESET=hidden "$@"
done
