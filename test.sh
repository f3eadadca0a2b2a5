#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test.
#   ./test.sh         release build
#   ./test.sh asan    AddressSanitizer and UndefinedBehaviorSanitizer
#   ./test.sh tsan    ThreadSanitizer
set -euo pipefail
cd "$(dirname "$0")"

case "${1:-release}" in
    release | asan | tsan) preset="${1:-release}" ;;
    *) echo "usage: ./test.sh [asan|tsan]" >&2; exit 2 ;;
esac
scripts/install_packages.sh
cmake --preset "$preset" -DDEFREC_BUILD_TESTS=ON >/dev/null
cmake --build --preset "$preset"
ctest --preset "$preset"
