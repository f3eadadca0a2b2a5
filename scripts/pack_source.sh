#!/usr/bin/env bash
# Packs what is committed, without tests, into FOLDER/defrec-VERSION.tar.xz. The same commit gives
# the same bytes. The tarball builds offline: the report of `defrec track` is then the page without
# 3D view, which needs npm's registry.
#   scripts/pack_source.sh FOLDER            packs
#   scripts/pack_source.sh --check FOLDER    packs, unpacks, configures, and fails where the build
#                                            would miss a file
set -euo pipefail
check=
[ "${1:-}" != --check ] || {
    check=1
    shift
}
[ $# = 1 ] || {
    echo "usage: scripts/pack_source.sh [--check] FOLDER" >&2
    exit 2
}
mkdir -p "$1"
folder="$(cd "$1" && pwd)"
cd "$(dirname "${BASH_SOURCE[0]}")/.."
git rev-parse --verify -q HEAD >/dev/null || {
    echo "skipped: this is no git checkout" >&2
    exit 77
}

version="$(sed -nE 's/^project\(defrec VERSION ([0-9.]+) .*/\1/p' CMakeLists.txt)"
name="defrec-$version"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
git archive --prefix="$name/" HEAD | tar -x -C "$work"
# cmake/test_main.cpp says whether there are tests (cmake/DefrecTesting.cmake).
(cd "$work/$name" && find . -name '*_test.cpp' -delete &&
    find . -type d \( -name tests -o -name browser_test \) -prune -exec rm -r {} + &&
    rm cmake/test_main.cpp test.sh)
tar --sort=name --mtime="@$(git log -1 --format=%ct)" --owner=0 --group=0 --numeric-owner \
    -C "$work" -cJf "$folder/$name.tar.xz" "$name"
echo "$folder/$name.tar.xz"

[ -n "$check" ] || exit 0
rm -rf "${work:?}/$name"
tar -xf "$folder/$name.tar.xz" -C "$work"
cmake -S "$work/$name" -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
    -DDEFREC_BUILD_CUDA=OFF >"$work/log" ||
    {
        cat "$work/log" >&2
        exit 1
    }
ninja -C "$work/build" -t inputs all | grep "^$work/$name/" >"$work/inputs"
missing="$(while read -r file; do [ -e "$file" ] || echo "$file"; done <"$work/inputs")"
[ -z "$missing" ] || {
    printf 'the tarball has not what the build reads:\n%s\n' "$missing" >&2
    exit 1
}
sources="$(grep -c '\.cpp$' "$work/inputs")"
[ "$sources" -gt 100 ] || {
    echo "the build reads only $sources sources" >&2
    exit 1
}
echo "complete: the build reads $sources sources"
