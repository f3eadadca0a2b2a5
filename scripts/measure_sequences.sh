# Sourced by measure_accuracy.sh and measure_calibration.sh with their arguments: renders and tracks
# sequences. Needs a build in build/. Sequences are rendered once and kept.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

defrec=build/bin/defrec
backend=auto
if [ "${1:-}" = --backend ]; then
    backend="$2"
    shift 2
fi
given=("$@") # folders: left/ right/ calibration.yaml points.csv truth.csv
reference_scenes=(heartbeat respiration indentation fast-cut out-of-body smoke stretch)

render() { # FOLDER SCENE OPTION...
    [ -f "$1/truth.csv" ] || "$defrec" render "${@:2}" --out "$1" --quiet
}

render_reference() { # SCENE SIZE; sets folder
    folder="out/sequences/$1-$2"
    render "$folder" "$1" --size "$2"
}

track() { # FOLDER; sets tracked
    tracked="out/tracked/$(basename "$1")"
    "$defrec" track --left "$1/left" --right "$1/right" --calibration "$1/calibration.yaml" \
        --points "$1/points.csv" --out "$tracked" --backend "$backend" --no-overlay --quiet
}
