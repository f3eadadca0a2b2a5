#!/usr/bin/env bash
# Builds library and plugins twice, from two folders of different length and at different times,
# without ccache, and fails unless they, the plugins' manifests and the builds' provenance have the
# same bytes. Takes what is committed.
#   scripts/check_reproducible.sh [--provenance FILE] [--builder URI] [OPTION_OF_CMAKE...]
# for example -DDEFREC_BUILD_CUDA=OFF. FILE gets the provenance, whose builder is URI. If there is
# a FILE already, somebody else's, the builds have to give the library and plugins that it names.
set -euo pipefail
provenance='' builder='urn:uuid:7e9f5028-ee67-5d51-84ec-13604f80ee54'
while [ $# -gt 1 ]; do
    case "$1" in
        --provenance) provenance="$(realpath "$2")" ;;
        --builder) builder="$2" ;;
        *) break ;;
    esac
    shift 2
done
cd "$(dirname "${BASH_SOURCE[0]}")/.."

commit="$(git rev-parse HEAD)"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
export CCACHE_DISABLE=1
program="$PWD/scripts/release/provenance.py"
for source in "$work/a" "$work/another/folder"; do
    mkdir -p "$source"
    git archive "$commit" | tar -x -C "$source"
    cmake -S "$source" -B "$source/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
        -DDEFREC_BUILD_CLI=OFF -DDEFREC_BUILD_TESTS=OFF "$@" >/dev/null
    cmake --build "$source/build" --target defrec defrec_plugins >/dev/null
    python3 -B "$program" write "$source/build" "$source/build/provenance" --builder "$builder" \
        --checkout "$PWD"
    (cd "$source/build/lib" &&
        find . -maxdepth 1 -type f \( -name 'libdefrec.so.*' -o -name 'defrec_plugin_*' \) -print0 |
        sort -z | xargs -0 sha256sum) >"$source/sums"
done
[ -s "$work/a/sums" ]
for file in sums build/provenance; do
    diff "$work/a/$file" "$work/another/folder/$file" || {
        echo "two builds differ" >&2
        exit 1
    }
done
python3 -B "$program" check "$work/a/build/provenance" --build "$work/another/folder/build"
cat "$work/a/sums"
[ -n "$provenance" ] || exit 0
if [ -e "$provenance" ]; then
    python3 -B "$program" check "$provenance" --build "$work/a/build" \
        --commit "$commit"
else
    cp "$work/a/build/provenance" "$provenance"
fi
