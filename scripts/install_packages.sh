#!/usr/bin/env bash
# Installs through apt what building and testing needs and is missing (Debian 12). As another user than root, through sudo.
set -euo pipefail

packages=(cmake ninja-build g++ pkg-config libeigen3-dev libhwy-dev libyaml-cpp-dev libcli11-dev nlohmann-json3-dev
          doctest-dev libboost-context-dev libopencv-dev libpng-dev zlib1g-dev python3-jsonschema doxygen binutils abigail-tools dpkg-dev file
          libopenigtlink-dev libvulkan-volk-dev libvulkan-dev glslang-tools spirv-tools mesa-vulkan-drivers vulkan-validationlayers
          mono-mcs mono-runtime libmono-system-core4.0-cil libmono-system-drawing4.0-cil libgdiplus libnunit-cil-dev nuget
          python3-numpy python3-pil python3-build python3-setuptools python3-wheel python3-venv mypy)
command -v node >/dev/null && command -v npm >/dev/null || packages+=(nodejs npm)

missing=()
for package in "${packages[@]}"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'install ok installed' || missing+=("$package")
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
[ "$(id -u)" = 0 ] || as_root=(sudo)
echo "installing: ${needed[*]}"
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -qq
"${as_root[@]}" apt-get install -y -qq --no-install-recommends "${needed[@]}" >/dev/null
