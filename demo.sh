#!/usr/bin/env bash
# Installs what is missing, builds, renders a beating surface, tracks it, scores it against the truth, and says where the report is.
set -euo pipefail
cd "$(dirname "$0")"

out="${1:-out/demo}"
scripts/install_packages.sh
cmake --preset release -DDEFREC_BUILD_TESTS=OFF >/dev/null
cmake --build --preset release
defrec=build/bin/defrec

"$defrec" render heartbeat --out "$out/sequence"
"$defrec" track --left "$out/sequence/left" --right "$out/sequence/right" --calibration "$out/sequence/calibration.yaml" \
    --points "$out/sequence/points.csv" --out "$out/tracked"
"$defrec" score "$out/tracked" --truth "$out/sequence/truth.csv"
echo
echo "Open the report in a browser:  $PWD/$out/tracked/report.html"
echo "Deformed grid over the video:  $PWD/$out/tracked/overlay.mp4"
