#!/usr/bin/env bash
# Builds the libraries that libdefrec and the cpu plugin link, static, from Debian's source packages, into a folder for CMAKE_PREFIX_PATH:
# a wheel with these inside runs where Debian's libraries are not. They come through apt, from where this machine's packages come; nothing
# is installed and no privileges are needed. Wants a compiler, cmake, ninja, dpkg-dev.
#   scripts/make_static_libraries.sh FOLDER [CMAKE-ARGUMENT...]
# For another machine FOLDER lies below the sysroot, and the arguments name the toolchain.
set -euo pipefail
[ $# -ge 1 ] || { echo "usage: scripts/make_static_libraries.sh FOLDER [CMAKE-ARGUMENT...]" >&2; exit 2; }
mkdir -p "$1"
prefix="$(cd "$1" && pwd)"
shift
[ -z "$(ls -A "$prefix")" ] || { echo "$prefix is not empty" >&2; exit 2; }

state="$(mktemp -d)"
trap 'rm -rf "$state"' EXIT
mkdir -p "$state/lists/partial" "$state/sources"
# An apt of its own, that lists the sources. bookworm: the release whose packages the build is for.
mirror="$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' | head -n 1)"
printf 'deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] %s bookworm main\n' "$mirror" >"$state/sources.list"
apt=(apt-get -qq -o "Dir::State::lists=$state/lists" -o "Dir::Cache=$state" -o "Dir::Etc::sourcelist=$state/sources.list"
     -o Dir::Etc::sourceparts=/dev/null -o Debug::NoLocking=1 -o APT::Sandbox::User= -o Acquire::Languages=none -o APT::Update::Post-Invoke= )
"${apt[@]}" update
for package in yaml-cpp highway; do
    (cd "$state/sources" && "${apt[@]}" source "$package" >/dev/null)
    folder="$(ls -d "$state/sources/$package"-*/)"
    cmake -S "$folder" -B "$folder/build" -G Ninja -DCMAKE_BUILD_TYPE=Release "-DCMAKE_INSTALL_PREFIX=$prefix" -DCMAKE_INSTALL_LIBDIR=lib \
        -DBUILD_SHARED_LIBS=OFF -DYAML_BUILD_SHARED_LIBS=OFF -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DCMAKE_CXX_VISIBILITY_PRESET=hidden \
        -DBUILD_TESTING=OFF -DYAML_CPP_BUILD_TESTS=OFF -DYAML_CPP_BUILD_TOOLS=OFF -DHWY_ENABLE_EXAMPLES=OFF -DHWY_ENABLE_CONTRIB=OFF \
        -Wno-dev "$@" >/dev/null
    cmake --build "$folder/build" --target install -j "${JOBS:-2}" >/dev/null
    install -D -m 644 "$folder/debian/copyright" "$prefix/share/doc/$package/copyright"
    echo "$package $(dpkg-parsechangelog -l "$folder/debian/changelog" -S Version)"
done
