#!/usr/bin/env bash
# Installs what is missing, builds everything and runs tests.
#   ./test.sh         release build; the tests without the label slow (cmake/DefrecTesting.cmake)
#   ./test.sh all     release build; every test
#   ./test.sh asan    AddressSanitizer and UndefinedBehaviorSanitizer; every test
#   ./test.sh tsan    ThreadSanitizer; every test
#   ./test.sh fuzz    each fuzz target for a minute, and no test
set -euo pipefail
cd "$(dirname "$0")"

case "${1:-}" in
    "") build=release tests=release ;;
    all) build=release tests=release-all ;;
    asan | tsan) build="$1" tests="$1" ;;
    fuzz) scripts/install_packages.sh fuzz && exec scripts/fuzz.sh 0.0167 ;;
    *)
        echo "usage: ./test.sh [all|asan|tsan|fuzz]" >&2
        exit 2
        ;;
esac
scripts/install_packages.sh
cmake --preset "$build" -DDEFREC_BUILD_TESTS=ON >/dev/null
cmake --build --preset "$build"
ctest --preset "$tests"
