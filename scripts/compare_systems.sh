#!/usr/bin/env bash
# Whether a build for another system computes what this machine's does, to the last digit that is
# printed: the samples in C track a rendered sequence, deform a mesh and make a disparity map, with
# both builds, on the backends reference and cpu, and on vulkan where both builds have a device for
# it.
#   scripts/compare_systems.sh BUILD OTHER_BUILD EMULATOR...
#   xvfb-run -a scripts/compare_systems.sh build build-windows env WINEDEBUG=-all wine
# EMULATOR is the command that runs the other build's programs. Exit status 1: they differ.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[ $# -ge 3 ] || {
    echo "usage: scripts/compare_systems.sh BUILD OTHER_BUILD EMULATOR..." >&2
    exit 2
}
build=$1 other=$2
shift 2
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
"$build/bin/defrec" render heartbeat --size 320x240 --frames 12 --quiet --out "$work/sequence"
camera=333.33333333333331,333.33333333333331,159.5,119.5,4.5999999999999996

outputs() { # DEVICE FOLDER COMMAND...: a sample's name goes where {} is
    local device=$1 folder=$2
    local command=("${@:3}")
    sample() { "${command[@]//\{\}/$1}" "${@:2}" >/dev/null; }
    mkdir -p "$folder"
    local left="$work/sequence/left" right="$work/sequence/right"
    sample track_folder "$left" "$right" "$camera" "$work/sequence/points.csv" \
        "$folder/points.csv" "$device"
    sample warp_mesh "$left" "$right" "$camera" samples/tumour.obj "$folder/meshes" "$device"
    sample stereo_only "$left/000000.png" "$right/000000.png" "$folder/disparity.pgm" "$device"
}

program="$other/samples/c/bin/{}"
[ ! -f "$other/lib/track_folder.exe" ] || program="$other/lib/{}.exe"
"$build/samples/c/bin/list_devices" >"$work/devices"
"$@" "${program//\{\}/list_devices}" >"$work/other_devices"
status=0
for device in reference cpu 'vulkan:*'; do
    backend=${device%%:*}
    if ! grep -q "^device $backend:" "$work/devices" ||
        ! grep -q "^device $backend:" "$work/other_devices"; then
        echo "$backend: skipped, not both have a device"
        [ "$backend" = vulkan ] || status=1
        continue
    fi
    outputs "$device" "$work/$backend" "$build/samples/c/bin/{}"
    outputs "$device" "$work/other_$backend" "$@" "$program"
    if diff -rq --strip-trailing-cr "$work/$backend" "$work/other_$backend"; then
        echo "$backend: $(find "$work/$backend" -type f | wc -l) files equal, among them" \
            "$(wc -l <"$work/$backend/points.csv") lines of points"
    else
        status=1
    fi
done
exit "$status"
