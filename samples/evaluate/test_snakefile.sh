#!/usr/bin/env bash
# Four small sequences by Snakemake and by the program alone, with the same tables.
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
cd "$folder"
code=0
"$defrec" evaluate --quiet --dataset defrec sequences --out alone --backend cpu || code=$?
[ "$code" -eq 6 ]
for file in results.csv summary.csv evaluation.html; do
    cmp "by-snakemake/$file" "alone/$file"
done
grep -q '^defrec,1,done,3,' alone/results.csv
grep -q '^defrec,4,quarantined,' alone/results.csv
