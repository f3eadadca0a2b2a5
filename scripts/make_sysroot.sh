#!/usr/bin/env bash
# Unpacks the libraries that a build for another architecture links, and the Vulkan driver for
# processors, into a folder: a sysroot for cmake/toolchains. They come through apt, from where this
# machine's packages come; nothing is installed and no privileges are needed.
#   scripts/make_sysroot.sh ARCHITECTURE FOLDER    ARCHITECTURE is Debian's word: arm64
set -euo pipefail
[ $# = 2 ] || {
    echo "usage: scripts/make_sysroot.sh ARCHITECTURE FOLDER" >&2
    exit 2
}
architecture=$1
mkdir -p "$2"
folder="$(cd "$2" && pwd)"
[ -z "$(ls -A "$folder")" ] || {
    echo "$folder is not empty" >&2
    exit 2
}
read -ra packages <<<"$("$(dirname "${BASH_SOURCE[0]}")/install_packages.sh" libraries)"

state="$(mktemp -d)"
trap 'rm -rf "$state"' EXIT
mkdir -p "$state/lists/partial" "$state/archives/partial"
: >"$state/status"
# An apt of its own: as on a machine of that architecture on which nothing is installed.
apt=(apt-get -qq -o "APT::Architecture=$architecture" -o "APT::Architectures=$architecture"
    -o "Dir::State=$state" -o "Dir::State::lists=$state/lists" -o "Dir::State::status=$state/status"
    -o "Dir::Cache=$state" -o "Dir::Cache::archives=$state/archives" -o Debug::NoLocking=1
    -o APT::Sandbox::User= -o APT::Keep-Downloaded-Packages=true -o Acquire::Languages=none
    -o APT::Update::Post-Invoke::=)
"${apt[@]}" update
"${apt[@]}" install -y --no-install-recommends --download-only "${packages[@]}" mesa-vulkan-drivers
# Debian's merged /usr.
mkdir -p "$folder/usr/lib" "$folder/usr/bin" "$folder/usr/sbin"
ln -s usr/lib usr/bin usr/sbin "$folder"
# so that dpkg-query and dpkg-shlibdeps know whose a file is, and what to depend on
database="$folder/var/lib/dpkg"
mkdir -p "$database/info"
echo 1 >"$database/info/format"
for deb in "$state"/archives/*.deb; do
    dpkg-deb --fsys-tarfile "$deb" | tar -x --keep-directory-symlink --no-same-owner -C "$folder"
    name="$(dpkg-deb -f "$deb" Package)"
    [ "$(dpkg-deb -f "$deb" Multi-Arch)" != same ] || name+=":$architecture"
    dpkg-deb --fsys-tarfile "$deb" | tar -t | sed -e 's,^\./,/,' -e 's,/$,,' -e 's,^$,/.,' \
        >"$database/info/$name.list"
    {
        dpkg-deb -f "$deb" | sed '/^Package:/a Status: install ok installed'
        echo
    } >>"$database/status"
    for file in $(dpkg-deb --ctrl-tarfile "$deb" | tar -t | grep -xE './(shlibs|symbols)'); do
        dpkg-deb --ctrl-tarfile "$deb" | tar -xO "$file" >"$database/info/$name.$(basename "$file")"
    done
done
# What the packages' scripts would link by update-alternatives.
for library in blas lapack; do
    for file in "$folder"/usr/lib/*/"$library"/lib"$library".so*; do
        [ ! -e "$file" ] || ln -sf "$library/$(basename "$file")" "$(dirname "$(dirname "$file")")/"
    done
done
echo "$folder: $(ls "$state/archives"/*.deb | wc -l) packages"
