#!/usr/bin/env bash
# Checks this machine's GPU: the tests of the GPU backends, the conformance suite, the benchmark,
# and the kernels under compute-sanitizer where it is installed. Needs bash, coreutils, grep, sed
# and the GPU's driver.
usage="usage: check.sh [OPTION...] [tests] [conformance] [bench] [sanitizer]
without a part: all of them
  --backend NAME    one of backends.txt in this folder; may be repeated. Default: those that find a
                    device
  --stage NAME      of tests, conformance and sanitizer what concerns this stage alone; may be
                    repeated
  --tier NAME       of conformance and sanitizer this tier alone, abi, stage, sequence or stress;
                    may be repeated (conformance without --stage, --tier and --smoke is one run of
                    the whole suite, whose report can be kept)
  --tool NAME       of the sanitizer: memcheck, racecheck, initcheck or synccheck; may be repeated.
                    Default: all four
  --smoke           of conformance and sanitizer the suite's short list
  --jobs N          processes at once; default: as many as processors. The benchmark is always alone
  --time-limit S    for everything; what has not ended by then is ended, and not passed. Default
                    3600
  --out FOLDER      for results; default: results, in the folder where you are"
set -uo pipefail
here="$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")"

fail_usage() {
    printf '%s\n%s\n' "$1" "$usage" >&2
    exit 2
}
one_of() { # NAME GIVEN KNOWN...
    local name="$1" given="$2"
    shift 2
    [[ " $* " == *" $given "* ]] || fail_usage "$name: '$given' is none of $*"
}
whole() { [[ "$2" =~ ^[1-9][0-9]{0,6}$ ]] || fail_usage "$1: '$2' is no whole number from 1 on"; }
mapfile -t all_backends <"$here/backends.txt"
mapfile -t all_stages <"$here/stages.txt"
all_tools=(memcheck racecheck initcheck synccheck)
parts=() backends=() stages=() tiers=() tools=() smoke=()
places="$(nproc)" time_limit=3600 out=results
while [ $# -gt 0 ]; do
    case "$1" in
        --backend | --stage | --tier | --tool | --jobs | --time-limit | --out)
            [ $# -ge 2 ] || fail_usage "$1: a value expected"
            ;;
    esac
    case "$1" in
        tests | conformance | bench | sanitizer) parts+=("$1") ;;
        --backend)
            one_of "$1" "$2" "${all_backends[@]}"
            backends+=("$2")
            shift
            ;;
        --stage)
            one_of "$1" "$2" "${all_stages[@]}"
            stages+=("$2")
            shift
            ;;
        --tier)
            one_of "$1" "$2" abi stage sequence stress
            tiers+=("$2")
            shift
            ;;
        --tool)
            one_of "$1" "$2" "${all_tools[@]}"
            tools+=("$2")
            shift
            ;;
        --smoke) smoke=(--smoke) ;;
        --jobs)
            whole "$1" "$2"
            places="$2"
            shift
            ;;
        --time-limit)
            whole "$1" "$2"
            time_limit="$2"
            shift
            ;;
        --out)
            out="$2"
            shift
            ;;
        --help)
            echo "$usage"
            exit 0
            ;;
        *) fail_usage "unknown: $1" ;;
    esac
    shift
done
[ ${#parts[@]} -gt 0 ] || parts=(tests conformance bench sanitizer)
[ ${#tools[@]} -gt 0 ] || tools=("${all_tools[@]}")
mkdir -p "$out" && out="$(cd "$out" && pwd)" || exit 2
summary="$out/summary.txt"
: >"$summary"

# ---- what the machine lacks ----------------------------------------------------------------------

library_path="$here/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
export LD_LIBRARY_PATH="$library_path"
spare() { LD_LIBRARY_PATH="$LD_LIBRARY_PATH:$here/lib/spare/$1"; }
for library in libgcc_s.so.1 libstdc++.so.6; do # missing, or older than what this was built with
    "$here/bin/defrec-bench" devices >/dev/null 2>&1 || spare "$library"
done
if ! "$here/bin/defrec-bench" devices >"$out/devices.txt" 2>&1; then
    cat "$out/devices.txt" >&2
    echo "check.sh: the programs do not run here" >&2
    exit 2
fi
if ! grep -q '^vulkan:' "$out/devices.txt"; then
    spare libvulkan.so.1
    # where containers have it, and no loader looks
    driver=/usr/local/nvidia/share/vulkan/icd.d/nvidia_icd.json
    [ -n "${VK_DRIVER_FILES:-}" ] || [ ! -e "$driver" ] || export VK_DRIVER_FILES="$driver"
    "$here/bin/defrec-bench" devices >"$out/devices.txt" 2>&1
fi
{
    uname -srm
    sed -n 's/^model name[^:]*: //p' /proc/cpuinfo | sort | uniq -c
    command -v nvidia-smi >/dev/null && nvidia-smi
} >"$out/machine.txt" 2>&1

if [ ${#backends[@]} -eq 0 ]; then
    for backend in "${all_backends[@]}"; do
        if grep -q "^$backend:" "$out/devices.txt"; then
            backends+=("$backend")
        else
            plugin="$(sed -n "s/.*defrec_plugin_$backend\.json: //p" "$out/devices.txt")"
            echo "skipped     $backend: no device (the plugin: ${plugin:-not in this folder})" |
                tee -a "$summary"
        fi
    done
fi

# ---- running -------------------------------------------------------------------------------------

left() { echo $((time_limit - SECONDS)); }
tell() { printf '%-11s %5d s  %s\n' "$1" "$2" "$3" | tee -a "$summary"; }
# NAME COMMAND...: its output in NAME.log, one line in the summary.
run() {
    local name="$1" log="$out/${1//\//_}.log" began=$SECONDS verdict code
    rm -rf "$log" "${log%.log}" "${log%.log}.json" # of an earlier run
    shift
    [ "$(left)" -gt 0 ] || {
        tell "NOT RUN" 0 "$name: no time left"
        return
    }
    timeout -k 5 "$(left)" "$@" >"$log" 2>&1 &
    trap "kill $! 2>/dev/null; exit" TERM
    wait $!
    code=$?
    case $code in
        0) verdict=passed ;;
        5) verdict=skipped ;; # defrec-conformance: no such device
        124 | 137) verdict="OUT OF TIME" ;;
        *) verdict=FAILED ;;
    esac
    if [ $code = 0 ] && grep -q 'skipped: no' "$log"; then verdict=skipped; fi
    tell "$verdict" $((SECONDS - began)) "$name"
    case "$verdict" in
        FAILED | "OUT OF TIME")
            grep -aE -m 5 'FAILED|ERROR|[Ee]rror:|^defrec-' "$log" | cut -c 1-200 |
                sed 's/^/                         /' | tee -a "$summary"
            ;;
    esac
}
start() {
    while [ "$(jobs -pr | wc -l)" -ge "$places" ]; do wait -n; done
    run "$@" 2>/dev/null & # where bash would tell of processes that were ended
}
trap 'kill $(jobs -p) 2>/dev/null; wait; exit 1' INT TERM

# ---- the parts -----------------------------------------------------------------------------------

tests() {
    local backend program source sources
    for backend in "${backends[@]}"; do
        for program in "$here/tests/defrec_${backend}"{,_memory,_trackers,_fault}_tests; do
            # Every backend has the first; it fails below where it is not there.
            [[ -e $program || $program == */"defrec_${backend}_tests" ]] || continue
            sources="$("$program" --list-test-cases --reporters=xml |
                sed -n 's/.*filename="[^"]*\/\([a-z_]*\)_test\.cpp".*/\1/p' | sort -u)" &&
                [ -n "$sources" ] || {
                tell FAILED 0 "tests/$backend: ${program##*/} does not list its tests"
                continue
            }
            [[ $program != *fault* ]] || wait # they take all of the GPU's memory, and make it fail
            for source in $sources; do
                [ ${#stages[@]} -eq 0 ] || [[ " ${stages[*]} " == *" ${source%%_*} "* ]] || continue
                start "tests/$backend/$source" \
                    "$program" --no-version "--source-file=*/${source}_test.cpp"
            done
            [[ $program != *fault* ]] || wait
        done
    done
}

# The patterns of cases that were chosen, one for each process: a stage, a sequence, a tier. $@: the
# tiers.
patterns() {
    local tier
    for tier in "$@"; do
        case "$tier" in
            stage)
                if [ ${#stages[@]} -gt 0 ]; then
                    printf 'stage/%s/*\n' "${stages[@]}"
                else
                    printf 'stage/%s/*\n' "${all_stages[@]}"
                fi
                ;;
            *) "$here/bin/defrec-conformance" --list --tier "$tier" "${smoke[@]}" | sed 's/ .*//' |
                if [ "$tier" = sequence ]; then cat; else sed 's|/.*|/*|' | sort -u; fi ;;
        esac
    done
}
examine() { # NAME PREFIX... -- OPTION...
    local name="$1" prefix=()
    shift
    while [ "$1" != -- ]; do
        prefix+=("$1")
        shift
    done
    shift
    start "$name" "${prefix[@]}" "$here/bin/defrec-conformance" --out "$out/${name//\//_}" "$@"
}

conformance() {
    local backend pattern chosen=("${tiers[@]}")
    [ ${#stages[@]} -eq 0 ] || [ ${#tiers[@]} -gt 0 ] || chosen=(stage)
    for backend in "${backends[@]}"; do
        if [ ${#chosen[@]} -eq 0 ]; then
            examine "conformance/$backend" -- --backend "$backend" "${smoke[@]}"
            continue
        fi
        while read -r pattern; do
            examine "conformance/$backend/${pattern%/\*}" -- \
                --backend "$backend" "${smoke[@]}" --case "$pattern"
        done <<<"$(patterns "${chosen[@]}")"
    done
}

# BACKEND NAME OPTION...: one run of the benchmark, its result in bench_BACKEND_NAME.json
measure() {
    local backend="$1" name="$2" log="$out/bench_$1_$2"
    shift 2
    start "bench/$backend/$name" \
        "$here/bin/defrec-bench" bench --backend "$backend" --json --quiet "$@"
    wait
    grep -q '^{' "$log.log" 2>/dev/null || return # it failed, or was not run
    mv "$log.log" "$log.json"
    sed -n -e '/"submit_to_result"/,/}/s/.*"\(median\|p99\)_ms": \([0-9.]*\).*/\1 \2 ms/p' \
        -e 's/.*"frames_per_second": \([0-9.]*\).*/\1 frames a second/p' "$log.json" |
        sed 's/^/                         /' | tee -a "$summary"
}
bench() {
    local backend
    wait
    for backend in "${backends[@]}"; do
        measure "$backend" 360x288 --size 360x288 --frames 600 --warm-up 300
        measure "$backend" 960x540 --size 960x540 --frames 600 --warm-up 300
        measure "$backend" 960x540_128 --size 960x540 --frames 600 --warm-up 300 \
            --config "$here/bench_128.yaml"
        measure "$backend" 1920x1080 --size 1920x1080 --frames 300 --warm-up 100
        measure "$backend" 960x540_32_trackers --size 960x540 --frames 100 --warm-up 20 \
            --trackers 32
    done
}

sanitizer() {
    local program tool pattern
    program="$(command -v compute-sanitizer ||
        ls /usr/local/cuda/bin/compute-sanitizer 2>/dev/null)"
    [ -n "$program" ] || {
        echo "skipped     sanitizer: compute-sanitizer is not installed" | tee -a "$summary"
        return
    }
    [[ " ${backends[*]} " == *" cuda "* ]] || {
        echo "skipped     sanitizer: no CUDA device" | tee -a "$summary"
        return
    }
    local chosen=("${tiers[@]}")
    if [ ${#tiers[@]} -eq 0 ]; then
        [ ${#stages[@]} -gt 0 ] && chosen=(stage) || chosen=(stage sequence)
    fi
    for tool in "${tools[@]}"; do
        while read -r pattern; do
            examine "sanitizer/$tool/${pattern%/\*}" "$program" --tool "$tool" \
                --target-processes all --error-exitcode 9 --print-limit 20 -- \
                --backend cuda "${smoke[@]}" --case "$pattern" --in-process
        done <<<"$(patterns "${chosen[@]}")"
    done
}

for part in tests conformance bench sanitizer; do
    [[ " ${parts[*]} " != *" $part "* ]] || "$part"
done
wait
! grep -qE '^(FAILED|NOT RUN|OUT OF TIME)' "$summary"
