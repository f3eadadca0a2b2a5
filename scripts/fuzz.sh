#!/usr/bin/env bash
# Builds the fuzz targets and runs each for so many hours, as many at a time as there are cores.
# What they find more is kept in build-fuzz/corpus, what breaks them in build-fuzz/findings
# (docs/safety/fuzzing.md). At the end a table of how much of the readers all these inputs reach, in
# build-fuzz/coverage.md.
#   scripts/fuzz.sh HOURS [TARGET...]
set -euo pipefail
cd "$(dirname "$0")/.."

[ $# -ge 1 ] || {
    sed -n '1d; /^#/!q; s/^# *//p' "$0" >&2
    exit 2
}
seconds=$(awk -v hours="$1" 'BEGIN { printf "%d", hours * 3600 + 0.5 }')
shift
for tool in clang clang++; do
    command -v $tool >/dev/null || {
        echo "the fuzz targets are left out: there is no $tool"
        exit 0
    }
done
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz
targets=("$@")
[ $# -gt 0 ] ||
    mapfile -t targets < <(cd sdk/fuzz && ls ./*_fuzz.cpp | sed 's|^./||; s|_fuzz.cpp$||')

run_one() { # TARGET SECONDS
    local folder="build-fuzz/corpus/$1" found="build-fuzz/findings" log="build-fuzz/$1.log" status=0
    local lengths=(-len_control=20)
    [ "$1" != template ] || lengths=() # it begins with whole files
    mkdir -p "$folder" "$found" "sdk/fuzz/corpus/$1"
    "build-fuzz/fuzz/defrec_$1_fuzz" -max_total_time="$2" -max_len=1000000 "${lengths[@]}" \
        -timeout=60 -rss_limit_mb=4096 -print_final_stats=1 -artifact_prefix="$found/$1-" \
        "$folder" "sdk/fuzz/corpus/$1" >"$log" 2>&1 || status=$?
    awk -v target="$1" -v status="$status" '
        / cov: / { for (i = 1; i < NF; ++i) if ($i == "cov:") covered = $(i + 1) }
        /number_of_executed_units/ { runs = $2 }
        END { printf "%-16s %10d executions, %6d edges%s\n", target, runs, covered,
                     status ? ", FAILED" : "" }' "$log"
    [ "$status" = 0 ] || {
        grep -m1 -A12 -E "ERROR|runtime error|libFuzzer" "$log" || tail -5 "$log"
        return 1
    }
}
export -f run_one
export UBSAN_OPTIONS=print_stacktrace=1 ASAN_OPTIONS=detect_stack_use_after_return=1
status=0
printf '%s\n' "${targets[@]}" | xargs -P "$(nproc)" -I{} bash -c "run_one {} $seconds" || status=$?
cmake --preset coverage >/dev/null
cmake --build --preset coverage >/dev/null
python3 -B scripts/fuzz/coverage.py "${targets[@]}" | tee build-fuzz/coverage.md
exit $status
