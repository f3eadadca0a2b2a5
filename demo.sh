#!/usr/bin/env bash
# Installs what is missing, builds the program, renders a beating surface, tracks it, scores it
# against the truth, and says where the report is. Builds what it runs and no more, in the folder
# and with the configuration of test.sh: each may follow the other.
#   ./demo.sh [FOLDER]    FOLDER: of the results, default out/demo
set -euo pipefail
cd "$(dirname "$0")"

out="${1:-out/demo}"
scripts/install_packages.sh build
cmake --preset release >/dev/null
cmake --build --preset demo
defrec=build/bin/defrec

"$defrec" render heartbeat --out "$out/sequence"
"$defrec" track --left "$out/sequence/left" --right "$out/sequence/right" \
    --calibration "$out/sequence/calibration.yaml" --points "$out/sequence/points.csv" \
    --backend cpu --out "$out/tracked"
"$defrec" score "$out/tracked" --truth "$out/sequence/truth.csv"
echo
echo "Open the report in a browser:  $(realpath "$out")/tracked/report.html"
echo "Deformed grid over the video:  $(realpath "$out")/tracked/overlay.mp4"
