#!/usr/bin/env bash
# Runs the samples of one language on a reference sequence and looks at what they write.
#   test_samples.sh SEQUENCE TRACKED WORK_FOLDER TRIED COMMAND...
# COMMAND, with the name of a sample for "{}", runs it. TRACKED is what `defrec track` made of
# SEQUENCE and of the targets in plan.csv, shown 66 ms later; TRIED another language's WORK_FOLDER,
# or none.
set -euo pipefail
sequence=$1 tracked=$2 work=$3 tried=$4
shift 4
here=$(cd "$(dirname "$0")" && pwd)
camera=333.33333333333331,333.33333333333331,159.5,119.5,4.5999999999999996
left=$sequence/left right=$sequence/right
frames=$(find "$left" -name '*.png' | wc -l)

sample() {
    local name=$1
    shift
    "${command[@]//\{\}/$name}" "$@"
}
command=("$@")

# STATUS PATTERN NAME ARGUMENT...: that exit code, and one line on stderr with the pattern
fails_with() {
    local status=$1 pattern=$2 result=0
    shift 2
    sample "$@" >"$work/stdout" 2>"$work/stderr" || result=$?
    if [ "$result" != "$status" ] || [ "$(wc -l <"$work/stderr")" != 1 ] ||
        ! grep -qE "$pattern" "$work/stderr"; then
        echo "$*: exit code $result, expected $status and one line like \"$pattern\"; it said:"
        cat "$work/stderr"
        exit 1
    fi
}

rm -rf "$work"
mkdir -p "$work"

sample list_devices >"$work/devices.txt"
grep -q '^defrec [0-9.]*, API 1\.' "$work/devices.txt"
grep -qE '^device cpu: .* ([0-9]+) of \1 stages' "$work/devices.txt"

sample track_folder "$left" "$right" "$camera" "$sequence/points.csv" "$work/points.csv" cpu
python3 "$here/compare_points.py" "$tracked/points.csv" "$work/points.csv"

# Points are pixels of the first image. Where it shows no surface, or one that is given up later,
# they are lost, and no other template is asked for them.
for kind in black soft; do
    python3 "$here/other_scene.py" "$kind" "$sequence" "$work/$kind"
    sample track_folder "$work/$kind/left" "$work/$kind/right" "$camera" "$sequence/points.csv" \
        "$work/$kind/points.csv" cpu
    grep -q "^$frames,.*,lost,\$" "$work/$kind/points.csv"
    if grep '^[1-9].*[0-9]$' "$work/$kind/points.csv"; then exit 1; fi
    sample plan_beneath "$work/$kind/left" "$work/$kind/right" "$camera" "$here/plan.csv" \
        "$work/$kind/plan" cpu >/dev/null 2>"$work/$kind/said"
done
if grep -q '^0,.*[0-9]$' "$work/black/points.csv"; then exit 1; fi
grep -q '^0,.*[0-9]$' "$work/soft/points.csv"

# Targets of a template that is given up are lost, which is said once, and the program goes on.
[ "$(wc -l <"$work/soft/said")" = 1 ]
grep -qE '^frame [1-9][0-9]*: the template was given up' "$work/soft/said"
grep -q '^0,.*[0-9]$' "$work/soft/plan/targets.csv"
grep -q "^$frames,.*,lost,\$" "$work/soft/plan/targets.csv"
if [ -s "$work/black/said" ]; then exit 1; fi

sample display_points "$left" "$right" "$camera" "$sequence/points.csv" 66 "$work/shown.csv" cpu
python3 "$here/compare_points.py" "$tracked/display.csv" "$work/shown.csv"
# The tissue moves on meanwhile.
if cmp -s "$work/points.csv" "$work/shown.csv"; then exit 1; fi

sample warp_mesh "$left" "$right" "$camera" "$here/tumour.obj" "$work/meshes" cpu
[ "$(find "$work/meshes" -name '*.ply' | wc -l)" = "$frames" ]
if cmp "$work/meshes/000000.ply" "$work/meshes/000003.ply"; then exit 1; fi
# Mono prints a small negative number without its sign.
if [ "$tried" != none ]; then
    for mesh in "$tried/meshes"/*; do
        diff <(sed 's/-0\.0000/0.0000/g' "$mesh") \
            <(sed 's/-0\.0000/0.0000/g' "$work/meshes/$(basename "$mesh")")
    done
fi

sample plan_beneath "$left" "$right" "$camera" "$here/plan.csv" "$work/plan" cpu >"$work/plan.txt"
python3 "$here/compare_points.py" "$tracked/targets.csv" "$work/plan/targets.csv"
ready='body ready, 16 of 16 targets, expected error up to [0-9.]+ mm'
[ "$(grep -cE "^frame [0-9]+: $ready\$" "$work/plan.txt")" = "$frames" ]
image_size=$((15 + 3 * 320 * 240))
[ "$(find "$work/plan" -name '*.ppm' -size "${image_size}c" | wc -l)" = "$frames" ]
# Targets beneath the surface are orange.
LC_ALL=C grep -qaP '\xff\xb0\x20' "$work/plan/000003.ppm"
if [ "$tried" != none ]; then diff -r "$tried/plan" "$work/plan"; fi

sample stereo_only "$left/000000.png" "$right/000000.png" "$work/disparity.pgm" cpu
[ "$(head -c 2 "$work/disparity.pgm")" = P5 ]
[ "$(wc -c <"$work/disparity.pgm")" = $((17 + 2 * 320 * 240)) ]

for deadline in 10000 0; do
    sample live_loop "$left" "$right" "$camera" "$deadline" cpu >"$work/live.txt"
    grep -qE '^frame [0-9]+ (in time|late): tracking' "$work/live.txt"
    # Behind many dropped frames the tissue may have moved far, and the frame is degraded or lost.
    states='tracking|degraded|lost|relocalised'
    seen=$(grep -cE "^frame [0-9]+ (in time|late): ($states)" "$work/live.txt")
    grep -q "^$frames frames from the camera, $seen tracked, $((frames - seen)) dropped\$" \
        "$work/live.txt"
    if [ "$deadline" = 0 ] && grep 'in time' "$work/live.txt"; then exit 1; fi
done

fails_with 2 '^usage: track_folder ' track_folder "$left"
fails_with 2 '^usage: display_points ' display_points "$left" "$right" "$camera"
fails_with 2 '^usage: plan_beneath ' plan_beneath "$left" "$right" "$camera" "$here/plan.csv"
fails_with 2 '^usage: live_loop ' live_loop "$left" "$right" "$camera" soon
points="$sequence/points.csv"
fails_with 1 'absent' track_folder "$work/absent" "$right" "$camera" "$points" "$work/none.csv"
fails_with 1 'FX,FY,CX,CY,BASELINE_MM' \
    track_folder "$left" "$right" 1,2,3 "$points" "$work/none.csv"
fails_with 1 'DEFREC_ERROR_' \
    track_folder "$left" "$right" 333,333,159,119,0 "$points" "$work/none.csv"
# The program in C takes it for its usage.
refused=1
if [ "$tried" = none ]; then refused=2; fi
fails_with "$refused" 'DEFREC_ERROR_ARGUMENT|^usage: ' \
    display_points "$left" "$right" "$camera" "$points" 101 "$work/none.csv" cpu
printf 'id;u;v\n1;100,5;100\n' >"$work/semicolons.csv"
fails_with 1 'semicolons.csv: .*id,u,v' \
    track_folder "$left" "$right" "$camera" "$work/semicolons.csv" "$work/none.csv"
printf '%s\r\n' 'v 0 0 50' 'v 9 0 50' 'v 9 9 50' 'v 0 9 50' 'f 1 2 3 4' 'f 1 2 3 4' 'f 1 2 3 4' \
    >"$work/quads.obj"
fails_with 1 'quads.obj: .*"f A B C".*"f 1 2 3 4"$' \
    warp_mesh "$left" "$right" "$camera" "$work/quads.obj" "$work/none"
printf 'id,x,y\n1,2,3\n' >"$work/flat.csv"
fails_with 1 'flat.csv: the columns id,x,y,z expected' \
    plan_beneath "$left" "$right" "$camera" "$work/flat.csv" "$work/none"
for row in 1,2,3 1,2,3,deep 1,2,,3; do
    printf 'id,x,y,z\n0,0,0,90\n%s\n' "$row" >"$work/row.csv"
    fails_with 1 'row.csv: ' plan_beneath "$left" "$right" "$camera" "$work/row.csv" "$work/none"
done
printf 'id,x,y,z\n' >"$work/nothing.csv"
fails_with 1 'nothing.csv: ' \
    plan_beneath "$left" "$right" "$camera" "$work/nothing.csv" "$work/none"
mkdir "$work/cut"
cp "$left/000000.png" "$work/cut"
for image in "$left"/*.png; do [ -e "$work/cut/${image##*/}" ] || : >"$work/cut/${image##*/}"; done
fails_with 1 'cut/000001.png' live_loop "$work/cut" "$right" "$camera" 10000
fails_with 1 'no_such_device' \
    stereo_only "$left/000000.png" "$right/000000.png" "$work/none.pgm" no_such_device
echo "all samples do what they say"
