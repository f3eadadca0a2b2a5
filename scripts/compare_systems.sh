#!/usr/bin/env bash
# Whether a build for another system computes what this machine's does, to the last digit that is printed: the samples in C track a rendered
# sequence, deform a mesh and make a disparity map, with both builds, on the backends reference and cpu.
#   scripts/compare_systems.sh BUILD OTHER_BUILD EMULATOR...
#   scripts/compare_systems.sh build build-windows env WINEDEBUG=-all wine
# EMULATOR is the command that runs the other build's programs. Exit status 1: they differ.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[ $# -ge 3 ] || { echo "usage: scripts/compare_systems.sh BUILD OTHER_BUILD EMULATOR..." >&2; exit 2; }
build=$1 other=$2
shift 2
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
"$build/bin/defrec" render heartbeat --size 320x240 --frames 12 --quiet --out "$work/sequence"
camera=333.33333333333331,333.33333333333331,159.5,119.5,4.5999999999999996

outputs() {  # BACKEND FOLDER COMMAND...: a sample's name goes where {} is
    local backend=$1 folder=$2
    local command=("${@:3}")
    sample() { "${command[@]//\{\}/$1}" "${@:2}" >/dev/null; }
    mkdir -p "$folder"
    sample track_folder "$work/sequence/left" "$work/sequence/right" "$camera" "$work/sequence/points.csv" "$folder/points.csv" "$backend"
    sample warp_mesh "$work/sequence/left" "$work/sequence/right" "$camera" samples/tumour.obj "$folder/meshes" "$backend"
    sample stereo_only "$work/sequence/left/000000.png" "$work/sequence/right/000000.png" "$folder/disparity.pgm" "$backend"
}

program="$other/samples/c/bin/{}"
[ ! -f "$other/lib/track_folder.exe" ] || program="$other/lib/{}.exe"
status=0
for backend in reference cpu; do
    outputs "$backend" "$work/$backend" "$build/samples/c/bin/{}"
    outputs "$backend" "$work/other_$backend" "$@" "$program"
    if diff -rq --strip-trailing-cr "$work/$backend" "$work/other_$backend"; then
        echo "$backend: $(find "$work/$backend" -type f | wc -l) files equal, among them $(wc -l <"$work/$backend/points.csv") lines of points"
    else
        status=1
    fi
done
exit "$status"
