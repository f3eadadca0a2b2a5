#!/usr/bin/env bash
# Builds library and plugins twice, from two folders of different length and at different times,
# without ccache, and fails unless they and the plugins' manifests have the same bytes. Takes what
# is committed.
#   scripts/check_reproducible.sh [OPTION_OF_CMAKE...]    for example -DDEFREC_BUILD_CUDA=OFF
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
export CCACHE_DISABLE=1
for source in "$work/a" "$work/another/folder"; do
    mkdir -p "$source"
    git archive HEAD | tar -x -C "$source"
    cmake -S "$source" -B "$source/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
        -DDEFREC_BUILD_CLI=OFF -DDEFREC_BUILD_TESTS=OFF "$@" >/dev/null
    cmake --build "$source/build" --target defrec defrec_plugins >/dev/null
    (cd "$source/build/lib" &&
        find . -maxdepth 1 -type f \( -name 'libdefrec.so.*' -o -name 'defrec_plugin_*' \) -print0 |
        sort -z | xargs -0 sha256sum) >"$source/sums"
done
[ -s "$work/a/sums" ]
diff "$work/a/sums" "$work/another/folder/sums" || {
    echo "two builds differ" >&2
    exit 1
}
cat "$work/a/sums"
