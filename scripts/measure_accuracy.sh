#!/usr/bin/env bash
# Tracks every reference sequence, and sequences given as folders, and prints the errors as a markdown table (docs/benchmarks.md).
#   scripts/measure_accuracy.sh [--backend NAME] [FOLDER...]     FOLDER: left/ right/ calibration.yaml points.csv truth.csv
# Sequences are rendered once into out/sequences and kept. Needs a build in build/.
set -euo pipefail
cd "$(dirname "$0")/.."

backend=auto
if [ "${1:-}" = --backend ]; then
    backend="$2"
    shift 2
fi
defrec=build/bin/defrec
folders=()
render() {  # SCENE SIZE
    local folder="out/sequences/$1-$2"
    [ -f "$folder/truth.csv" ] || "$defrec" render "$1" --size "$2" --out "$folder" --quiet
    folders+=("$folder")
}
for scene in heartbeat respiration indentation fast-cut out-of-body smoke stretch; do render "$scene" 960x540; done
for scene in heartbeat indentation; do render "$scene" 360x288; done
folders+=("$@")

echo "| sequence | visible median | visible p95 | hidden p95 | lost of visible | frames |"
echo "|---|---|---|---|---|---|"
for folder in "${folders[@]}"; do
    tracked="out/tracked/$(basename "$folder")"
    "$defrec" track --left "$folder/left" --right "$folder/right" --calibration "$folder/calibration.yaml" \
        --points "$folder/points.csv" --out "$tracked" --backend "$backend" --no-overlay --quiet
    "$defrec" score "$tracked" --truth "$folder/truth.csv" --json | node -e '
        const score = JSON.parse(require("fs").readFileSync(0));
        const mm = (x) => (x === null || x === undefined ? "-" : x.toFixed(3));
        console.log(`| '"$(basename "$folder")"' | ${mm(score.visible.median_mm)} | ${mm(score.visible.p95_mm)} | ` +
            `${mm(score.hidden.p95_mm)} | ${(100 * score.lost_share).toFixed(2)} % | ${score.frames} |`);'
done
