# Sourced: libraries from the source packages of the Debian release that the builds for other
# machines are for. They come through apt, from where this machine's packages come; nothing is
# installed and no privileges are needed. Wants cmake, ninja, dpkg-dev.

debian_mirror() {
    apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' |
        grep -m 1 .
}

# open_debian STATE: sets apt, an apt-get of its own in an empty folder that knows the release's
# packages and their sources.
open_debian() {
    local state=$1 keys=/usr/share/keyrings/debian-archive-keyring.gpg mirror
    mirror="$(debian_mirror)"
    mkdir -p "$state/lists/partial" "$state/archives/partial" "$state/sources"
    : >"$state/status"
    printf '%s [signed-by=%s] %s bookworm main\n' \
        deb "$keys" "$mirror" deb-src "$keys" "$mirror" >"$state/sources.list"
    apt=(apt-get -qq -o "Dir::State=$state" -o "Dir::State::lists=$state/lists"
        -o "Dir::State::status=$state/status" -o "Dir::Cache=$state"
        -o "Dir::Cache::archives=$state/archives" -o "Dir::Etc::sourcelist=$state/sources.list"
        -o Dir::Etc::sourceparts=/dev/null -o Debug::NoLocking=1 -o APT::Sandbox::User=
        -o Acquire::Languages=none -o APT::Update::Post-Invoke=)
    "${apt[@]}" update
}

# build_static STATE SOURCE-PACKAGE PREFIX DOCUMENTS [CMAKE-ARGUMENT...]: installs it into PREFIX,
# its copyright below DOCUMENTS, without shared libraries, tests and programs, and prints its
# version.
build_static() {
    local state=$1 package=$2 prefix=$3 documents=$4 folder
    shift 4
    (cd "$state/sources" && "${apt[@]}" source "$package" >/dev/null)
    folder="$(ls -d "$state/sources/$package"-*/)"
    cmake -S "$folder" -B "$folder/build" -G Ninja -DCMAKE_BUILD_TYPE=Release \
        "-DCMAKE_INSTALL_PREFIX=$prefix" -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_SHARED_LIBS=OFF \
        -DYAML_BUILD_SHARED_LIBS=OFF -DPNG_SHARED=OFF -DBUILD_TESTING=OFF \
        -DYAML_CPP_BUILD_TESTS=OFF -DYAML_CPP_BUILD_TOOLS=OFF -DYAML_CPP_BUILD_CONTRIB=OFF \
        -DHWY_ENABLE_EXAMPLES=OFF -DHWY_ENABLE_CONTRIB=OFF -DPNG_TESTS=OFF -DPNG_EXECUTABLES=OFF \
        -Wno-dev --no-warn-unused-cli "$@" >/dev/null
    cmake --build "$folder/build" --target install -j "${JOBS:-2}" >/dev/null
    install -D -m 644 "$folder/debian/copyright" "$documents/$package/copyright"
    echo "$package $(dpkg-parsechangelog -l "$folder/debian/changelog" -S Version)"
}
