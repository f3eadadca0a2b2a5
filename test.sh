#!/usr/bin/env bash
# Installs what is missing, builds everything and runs every test.
#   ./test.sh         release build
#   ./test.sh asan    AddressSanitizer and UndefinedBehaviorSanitizer
#   ./test.sh tsan    ThreadSanitizer
#   ./test.sh fuzz    each fuzz target for a minute, and no test
set -euo pipefail
cd "$(dirname "$0")"

case "${1:-release}" in
    release | asan | tsan) preset="${1:-release}" ;;
    fuzz) scripts/install_packages.sh fuzz && exec scripts/fuzz.sh 0.0167 ;;
    *)
        echo "usage: ./test.sh [asan|tsan|fuzz]" >&2
        exit 2
        ;;
esac
scripts/install_packages.sh
cmake --preset "$preset" -DDEFREC_BUILD_TESTS=ON >/dev/null
cmake --build --preset "$preset"
ctest --preset "$preset"
