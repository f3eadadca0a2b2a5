#!/usr/bin/env bash
# Installs through apt what is needed and missing (Debian 12). As another user than root, through
# sudo.
#   scripts/install_packages.sh             for building everything and for the tests
#   scripts/install_packages.sh build       for building the library, the plugins and the programs,
#                                           and for running these
#   scripts/install_packages.sh fuzz        for building those and the fuzz targets
# These print names and install nothing:
#   scripts/install_packages.sh list        what "build" installs for building where everything is
#                                           missing, without npm
#   scripts/install_packages.sh libraries   the libraries that a build and its tests link
set -euo pipefail

tools=(cmake ninja-build g++ pkg-config python3 glslang-tools spirv-tools)
libraries=(libeigen3-dev libhwy-dev libyaml-cpp-dev libcli11-dev nlohmann-json3-dev libopencv-dev
    libgstreamer-plugins-base1.0-dev liblz4-dev libopenigtlink-dev libpng-dev libsqlite3-dev
    libzstd-dev zlib1g-dev libvulkan-volk-dev libvulkan-dev)
test_libraries=(doctest-dev libboost-context-dev libcpp-httplib-dev)
cameras=(gstreamer1.0-plugins-base gstreamer1.0-plugins-good)
packages=("${tools[@]}" "${libraries[@]}" "${cameras[@]}")
command -v node >/dev/null && command -v npm >/dev/null || packages+=(nodejs npm)
case "${1:-all}" in
    build) ;;
    list)
        echo "${tools[@]}" "${libraries[@]}"
        exit 0
        ;;
    libraries)
        echo "${libraries[@]}" "${test_libraries[@]}"
        exit 0
        ;;
    fuzz) packages+=(clang libclang-rt-14-dev llvm) ;;
    all)
        packages+=("${test_libraries[@]}" gir1.2-gst-rtsp-server-1.0 python3-gi git openssh-client
            clang-format clang-tidy black shfmt cmake-format binutils abigail-tools doxygen dpkg-dev
            file mesa-vulkan-drivers vulkan-validationlayers mono-mcs mono-runtime
            libmono-system-core4.0-cil libnunit-cil-dev nuget mypy python3-build python3-jsonschema
            python3-matplotlib python3-nbclient python3-ipykernel jupyter-nbconvert
            python3-numpy python3-pil python3-setuptools python3-venv python3-wheel)
        ;;
    *)
        echo "usage: scripts/install_packages.sh [build|fuzz|list|libraries]" >&2
        exit 2
        ;;
esac

missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' ||
        missing+=("$package")
done
[ ${#missing[@]} -gt 0 ] || exit 0

# What is there in another way (a cmake of one's own, say) need not come from apt.
needed=()
for package in "${missing[@]}"; do
    case "$package" in
        cmake) command -v cmake >/dev/null && continue ;;
        ninja-build) command -v ninja >/dev/null && continue ;;
        g++) command -v g++ >/dev/null && continue ;;
    esac
    needed+=("$package")
done
[ ${#needed[@]} -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null || {
        echo "missing, and without sudo for root to install: ${needed[*]}" >&2
        exit 1
    }
    as_root=(sudo)
fi
echo "installing: ${needed[*]}"
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" apt-get install -y -qq --no-install-recommends "${needed[@]}" >/dev/null
