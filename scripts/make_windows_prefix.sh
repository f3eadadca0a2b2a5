#!/usr/bin/env bash
# Builds the libraries that a build for Windows links, from Debian's source packages, into a folder: a prefix for
# cmake/toolchains/x86_64-w64-mingw32.cmake. They come through apt, from where this machine's packages come; nothing is installed and no
# privileges are needed. Wants g++-mingw-w64-x86-64-posix, cmake, ninja, dpkg-dev.
#   scripts/make_windows_prefix.sh FOLDER
set -euo pipefail
[ $# = 1 ] || { echo "usage: scripts/make_windows_prefix.sh FOLDER" >&2; exit 2; }
mkdir -p "$1"
prefix="$(cd "$1" && pwd)"
[ -z "$(ls -A "$prefix")" ] || { echo "$prefix is not empty" >&2; exit 2; }
toolchain="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/cmake/toolchains/x86_64-w64-mingw32.cmake"
target="$prefix/usr/x86_64-w64-mingw32"

state="$(mktemp -d)"
trap 'rm -rf "$state"' EXIT
mkdir -p "$state/lists/partial" "$state/archives/partial" "$state/etc" "$state/sources"
: >"$state/status"
# An apt of its own, that lists the sources, too. bookworm: the release whose packages the build is for.
mirror="$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' | head -n 1)"
keys=/usr/share/keyrings/debian-archive-keyring.gpg
printf '%s [signed-by=%s] %s bookworm main\n' deb "$keys" "$mirror" deb-src "$keys" "$mirror" >"$state/etc/sources.list"
apt=(apt-get -qq -o "Dir::State=$state" -o "Dir::State::lists=$state/lists" -o "Dir::State::status=$state/status" -o "Dir::Cache=$state"
     -o "Dir::Cache::archives=$state/archives" -o "Dir::Etc::sourcelist=$state/etc/sources.list" -o Dir::Etc::sourceparts=/dev/null
     -o Debug::NoLocking=1 -o APT::Sandbox::User= -o Acquire::Languages=none -o APT::Update::Post-Invoke= )
"${apt[@]}" update

# Headers, volk, which is one as well, and zlib, which Debian has for MinGW-w64.
(cd "$state/archives" && "${apt[@]}" download libeigen3-dev doctest-dev libcli11-dev nlohmann-json3-dev libvulkan-dev libvulkan-volk-dev \
    libz-mingw-w64-dev)
for deb in "$state"/archives/*.deb; do dpkg-deb --fsys-tarfile "$deb" | tar -x --no-same-owner -C "$prefix"; done
# doctest's is made for /usr alone.
sed -i "s|_IMPORT_PREFIX \"/usr\"|_IMPORT_PREFIX \"$prefix/usr\"|" "$prefix/usr/lib/cmake/doctest/doctestTargets.cmake"

build() {  # build SOURCE-PACKAGE [CMAKE-ARGUMENT...]
    local package=$1
    shift
    (cd "$state/sources" && "${apt[@]}" source "$package" >/dev/null)
    local folder
    folder="$(ls -d "$state/sources/$package"-*/)"
    cmake -S "$folder" -B "$folder/build" -G Ninja --toolchain "$toolchain" "-DDEFREC_WINDOWS_PREFIX=$prefix" -DCMAKE_BUILD_TYPE=Release \
        "-DCMAKE_INSTALL_PREFIX=$target" -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_SHARED_LIBS=OFF -Wno-dev "$@" >/dev/null
    cmake --build "$folder/build" --target install -j "${JOBS:-2}" >/dev/null
    install -D -m 644 "$folder/debian/copyright" "$prefix/usr/share/doc/$package/copyright"
    echo "$package $(dpkg-parsechangelog -l "$folder/debian/changelog" -S Version)"
}
build yaml-cpp -DYAML_BUILD_SHARED_LIBS=OFF -DYAML_CPP_BUILD_TESTS=OFF -DYAML_CPP_BUILD_TOOLS=OFF -DYAML_CPP_BUILD_CONTRIB=OFF
build libpng1.6 -DPNG_SHARED=OFF -DPNG_TESTS=OFF -DPNG_EXECUTABLES=OFF
build highway -DBUILD_TESTING=OFF -DHWY_ENABLE_EXAMPLES=OFF -DHWY_ENABLE_CONTRIB=OFF
echo "$prefix: libraries for 64-bit Windows"
