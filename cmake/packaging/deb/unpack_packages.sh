#!/bin/sh
# Unpacks Debian packages into an empty root with dpkg itself, which also finds files that two
# packages claim. Needs no privileges.
#   unpack_packages.sh PACKAGES ROOT
set -eu
packages=$1 root=$2
rm -rf "$root"
mkdir -p "$root/var/lib/dpkg/updates" "$root/var/lib/dpkg/info"
: >"$root/var/lib/dpkg/status"
: >"$root/var/lib/dpkg/available"
dpkg --root="$root" --log="$root/dpkg.log" --force-not-root --force-bad-path \
    --unpack "$packages"/*.deb
