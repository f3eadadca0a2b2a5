#!/usr/bin/env bash
# Tracks every reference sequence, and sequences given as folders, and prints the errors as a
# markdown table (docs/benchmarks.md).
#   scripts/measure_accuracy.sh [--backend NAME] [FOLDER...]
# FOLDER: left/ right/ calibration.yaml points.csv truth.csv
# Sequences are rendered once into out/sequences and kept. Needs a build in build/.
source "$(dirname "$0")/measure_sequences.sh"

folders=()
for scene in "${reference_scenes[@]}"; do
    render_reference "$scene" 960x540
    folders+=("$folder")
done
for scene in heartbeat indentation; do
    render_reference "$scene" 360x288
    folders+=("$folder")
done

echo "| sequence | visible median | visible p95 | hidden p95 | lost of visible | frames |"
echo "|---|---|---|---|---|---|"
for folder in "${folders[@]}" "${given[@]}"; do
    track "$folder"
    "$defrec" score "$tracked" --truth "$folder/truth.csv" --json | node -e '
        const score = JSON.parse(require("fs").readFileSync(0));
        const mm = (x) => (x === null || x === undefined ? "-" : x.toFixed(3));
        console.log(`| '"$(basename "$folder")"' | ${mm(score.visible.median_mm)} | ${mm(score.visible.p95_mm)} | ` +
            `${mm(score.hidden.p95_mm)} | ${(100 * score.lost_share).toFixed(2)} % | ${score.frames} |`);'
done
