#!/usr/bin/env bash
# The guide of docs/backends/plugins.md, tried: installs the SDK from a build folder, moves it to
# show that it can be moved, and runs every command of "Writing a plugin" but those that build the
# SDK, as they stand, in an empty folder.
#   test_guide.sh BUILD_FOLDER GUIDE WORK_FOLDER
set -euo pipefail
build=$1 guide=$2 work=$3

rm -rf "$work"
mkdir -p "$work/author"
cmake --install "$build" --prefix "$work/installed" >"$work/install.log"
mv "$work/installed" "$work/sdk"
export SDK="$work/sdk"

awk '/^## /     { inside = $0 == "## Writing a plugin" }
     /^```/     { block = inside && $0 == "```sh" ? block_start() : 0; next }
     inside && block { print }
     function block_start() { return ++blocks > 1 }' "$guide" >"$work/guide.sh"
[ "$(grep -c defrec-conformance "$work/guide.sh")" -ge 2 ]
cd "$work/author"
bash -euxo pipefail "$work/guide.sh"
