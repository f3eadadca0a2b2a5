#!/usr/bin/env bash
# Four small sequences by Snakemake, by the tasks of a Slurm array and by the program alone, with
# the same tables. There is no Slurm: the tasks are run with the variables that it sets.
#   test_snakefile.sh DEFREC FOLDER
set -euo pipefail
defrec="$1"
folder="$2"
rm -rf "$folder"
mkdir -p "$folder"
for seed in 1 2 3 4; do
    "$defrec" render heartbeat --quiet --size 320x240 --frames 3 --seed "$seed" \
        --out "$folder/sequences/$seed"
done
# One clip that cannot be read.
rm "$folder/sequences/4/truth.csv"
snakemake --quiet -s "$(dirname "$0")/Snakefile" --cores 2 --directory "$folder" --config \
    "defrec=$defrec" dataset=defrec root=sequences out=by-snakemake shards=3 "options=--backend cpu"
array="$(cd "$(dirname "$0")" && pwd)/slurm_array.sh"
cd "$folder"
as_task() { # NUMBER FIRST LAST COUNT
    SLURM_ARRAY_TASK_ID="$1" SLURM_ARRAY_TASK_MIN="$2" SLURM_ARRAY_TASK_MAX="$3" \
        SLURM_ARRAY_TASK_COUNT="$4" DEFREC="$defrec" "$array" "${by_array[@]}"
}
by_array=(--dataset defrec sequences --out by-array --backend cpu)
for task in 2 3 1; do as_task "$task" 1 3 3; done
DEFREC="$defrec" "$array" "${by_array[@]}" --merge
# Arrays whose numbers would leave out clips.
for numbers in "0 0 2 3" "1 1 5 3"; do
    code=0
    # shellcheck disable=SC2086
    as_task $numbers >/dev/null || code=$?
    [ "$code" -eq 2 ]
done
code=0
"$defrec" evaluate --quiet --dataset defrec sequences --out alone --backend cpu || code=$?
[ "$code" -eq 6 ]
for file in results.csv summary.csv evaluation.html; do
    cmp "by-snakemake/$file" "alone/$file"
    cmp "by-array/$file" "alone/$file"
done
grep -q '^defrec,1,done,3,' alone/results.csv
grep -q '^defrec,4,quarantined,' alone/results.csv
