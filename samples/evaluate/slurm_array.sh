#!/usr/bin/env bash
# A shard of `defrec evaluate` for each task of a Slurm job array, numbered from 1, then the merge:
#   job=$(sbatch --parsable --array=1-16 slurm_array.sh --dataset defrec sequences --out results)
#   sbatch --dependency=afterany:$job slurm_array.sh --dataset defrec sequences --out results
#   --merge
# The folders are on a file system that all nodes have. A task that was ended keeps its finished
# clips: submit again what is missing. DEFREC: the program, `defrec` unless set.
set -euo pipefail

if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    if [ "$SLURM_ARRAY_TASK_MIN" -ne 1 ] ||
        [ "$SLURM_ARRAY_TASK_MAX" -ne "$SLURM_ARRAY_TASK_COUNT" ]; then
        echo "the array's tasks have to be 1 to their number, as --array=1-16 makes them"
        exit 2
    fi
    cores="${SLURM_CPUS_PER_TASK:-1}"
    set -- "$@" --resume --threads 1 --jobs "$cores" \
        --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"
fi
code=0
"${DEFREC:-defrec}" evaluate --quiet "$@" || code=$?
[ "$code" -eq 6 ] || exit "$code" # 6: some clips do not count, which the tables say
