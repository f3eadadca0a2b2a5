#!/usr/bin/env bash
# Evaluates many short clips in one go, by shards, by Snakemake over cores and over a Slurm of this
# one machine, as a Slurm array, and killed in the middle and resumed: the merged results have to be
# the same bytes, with a clip that crashes, one that hangs and one that is malformed in quarantine.
#
# usage: test_evaluation_scale.sh WORK [CLIPS]
#   WORK   an absent or empty folder; everything is written there
#   CLIPS  how many, 200 unless given
# Environment: BUILD, the build folder (build); JOBS, clips at the same time (all cores).
# Needs snakemake 7, slurmctld, slurmd and a C compiler. Starts daemons of its own on ports 6817 and
# 6818 and ends them.
set -euo pipefail

[ $# -ge 1 ] || {
    sed -n '6,8p' "$0"
    exit 2
}
source_root="$(cd "$(dirname "$0")/.." && pwd)"
build="$(cd "${BUILD:-$source_root/build}" && pwd)"
clips="${2:-200}"
jobs="${JOBS:-$(nproc)}"
mkdir -p "$1"
work="$(cd "$1" && pwd)"
[ -z "$(ls -A "$work")" ] || {
    echo "$work is not empty"
    exit 2
}
export LD_LIBRARY_PATH="$build/lib" DEFREC_PLUGIN_PATH="$build/lib"
defrec="$build/bin/defrec"
root="$work/clips"

started=()
end_started() {
    for pid in "${started[@]}"; do kill "$pid" 2>/dev/null || true; done
}
trap end_started EXIT

mapfile -t scenes < <("$defrec" render --list 2>/dev/null | awk '/^[a-z]/ {print $1}' | head -10)
echo "rendering $clips clips of ${#scenes[@]} scenes, 160x120, 3 frames"
seq 1 "$clips" | xargs -P "$jobs" -I{} bash -c '
    scenes=($4); number=$1
    exec "$2" render "${scenes[number % ${#scenes[@]}]}" --seed "$number" --size 160x120 \
        --frames 3 --out "$3/$(printf %04d "$number")" >/dev/null' \
    _ {} "$defrec" "$root" "${scenes[*]}"
hanging="$root/hangs" crashing="$root/crashes" malformed="$root/malformed"
for clip in "$hanging" "$crashing" "$malformed"; do cp -r "$root/0001" "$clip"; done
rm "$malformed/truth.csv"
# The process of one clip crashes and that of another hangs, as a plugin with a fault would do.
cat >"$work/faults.c" <<'C'
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>
__attribute__((constructor)) static void fail(void) {
    char line[65536];
    FILE* file = fopen("/proc/self/cmdline", "r");
    if (file == NULL) return;
    const size_t length = fread(line, 1, sizeof line - 1, file);
    fclose(file);
    for (size_t i = 0; i + 15 <= length; ++i) {
        if (memcmp(line + i, "--clip\0crashes", 15) == 0) raise(SIGSEGV);
        while (memcmp(line + i, "--clip\0hangs", 13) == 0) pause();
    }
}
C
cc -shared -fPIC -O1 -o "$work/faults.so" "$work/faults.c"
export LD_PRELOAD="$work/faults.so"

options=(--backend cpu --threads 1 --time-limit 30)
run() { # NAME ARGUMENTS...: exit code 6 says that clips are in quarantine
    local name="$1" code=0
    shift
    "$defrec" evaluate --dataset defrec "$root" --out "$work/$name" --quiet "${options[@]}" "$@" \
        2>>"$work/$name.log" || code=$?
    [ "$code" -eq 0 ] || [ "$code" -eq 6 ] || {
        echo "$name: exit code $code"
        exit 1
    }
}
measure() { # NAME COMMAND...
    local name="$1" start end
    shift
    start=$(date +%s.%N)
    "$@"
    end=$(date +%s.%N)
    awk -v n="$name" -v c="$((clips + 3))" -v s="$start" -v e="$end" \
        'BEGIN { printf "%-12s %7.1f s %8.0f clips per hour\n", n, e - s, 3600 * c / (e - s) }'
}

one_go() { run one_go --jobs "$jobs"; }
four_shards() {
    for shard in 3 1 4 2; do run four_shards --jobs "$jobs" --shard "$shard/4"; done
    run four_shards --merge
}
killed() {
    "$defrec" evaluate --dataset defrec "$root" --out "$work/killed" --quiet "${options[@]}" \
        --jobs "$jobs" 2>>"$work/killed.log" &
    local pid=$!
    while [ "$(find "$work/killed/clips" -name samples.csv 2>/dev/null | wc -l)" \
        -lt $((clips / 4)) ]; do sleep 0.1; done
    kill -9 "$pid"
    wait "$pid" 2>/dev/null || true
    echo "killed after $(find "$work/killed/clips" -name samples.csv | wc -l) clips"
    run killed --jobs "$jobs" --resume
}
snakemake_over() { # NAME ARGUMENTS...
    local name="$1"
    shift
    snakemake -s "$source_root/samples/evaluate/Snakefile" --directory "$work/$name.snakemake" \
        --quiet --config defrec="$defrec" dataset=defrec root="$root" out="$work/$name" shards=8 \
        "options=--backend cpu --time-limit 30" "$@" >"$work/$name.log" 2>&1
}
cores() { snakemake_over cores --cores "$jobs"; }
slurm() {
    snakemake_over slurm --jobs 100 --latency-wait 30 \
        --cluster "sbatch --parsable --cpus-per-task {threads} --output $work/slurm.%j.txt"
}
slurm_array() {
    local script="$source_root/samples/evaluate/slurm_array.sh" job
    local arguments=(--dataset defrec "$root" --out "$work/slurm_array" --backend cpu
        --time-limit 30)
    job="$(DEFREC="$defrec" sbatch --parsable --array=1-8 --output "$work/slurm_array.%a.txt" \
        "$script" "${arguments[@]}")"
    DEFREC="$defrec" sbatch --wait --dependency="afterany:$job" --output "$work/slurm_array.txt" \
        "$script" "${arguments[@]}" --merge >/dev/null
}
start_slurm() {
    local dir="$work/slurmd"
    mkdir -p "$dir"
    export SLURM_CONF="$work/slurm.conf"
    cat >"$SLURM_CONF" <<CONF
ClusterName=one
SlurmctldHost=$(hostname -s)
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
AuthType=auth/none
CredType=cred/none
StateSaveLocation=$dir
SlurmdSpoolDir=$dir
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
NodeName=$(hostname -s) CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    env -u LD_PRELOAD slurmctld -D >"$work/slurmctld.log" 2>&1 &
    started+=($!)
    env -u LD_PRELOAD slurmd -D >"$work/slurmd.log" 2>&1 &
    started+=($!)
    for _ in $(seq 60); do
        sinfo --noheader --format %t 2>/dev/null | grep -q idle && return
        sleep 1
    done
    echo "Slurm does not start; see $work/slurmctld.log"
    exit 1
}

measure one_go one_go
measure four_shards four_shards
measure killed killed
measure cores cores
start_slurm
measure slurm slurm
measure slurm_array slurm_array

for name in four_shards killed cores slurm slurm_array; do
    for file in results.csv summary.csv evaluation.html; do
        cmp "$work/one_go/$file" "$work/$name/$file"
    done
done
echo "the merged results of all six are the same bytes"
grep -F quarantined "$work/one_go/results.csv"
grep -q "^defrec,crashes,quarantined,.*signal 11" "$work/one_go/results.csv"
grep -q "^defrec,hangs,quarantined,.*30 s" "$work/one_go/results.csv"
[ "$(grep -cF ,quarantined, "$work/one_go/results.csv")" -eq 3 ]
[ "$(grep -cF ,done, "$work/one_go/results.csv")" -eq "$clips" ]
