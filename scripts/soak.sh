#!/usr/bin/env bash
# Plays video for long with cuts, losses, gaps, new templates and trackers that come and go, in
# several threads, and judges whether memory, descriptors, threads or errors grow. Builds what it
# needs. Exit status 1: something grows, or a call failed.
#   scripts/soak.sh [OPTION...]           options of build/bin/defrec-soak: --minutes 30 --backend
#                                         vulkan --speed 0 --scene slide --grow ...
# Writes out/soak/samples.csv and out/soak/plot.svg. Where there is an NVIDIA GPU its memory is
# sampled, too.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

cmake --preset release >/dev/null
cmake --build --preset release --target defrec_soak_program defrec_plugins
folder=out/soak
mkdir -p "$folder"
device=()
if command -v nvidia-smi >/dev/null; then
    nvidia-smi --query-gpu=memory.used --format=csv,noheader,nounits --id=0 -l 1 \
        >"$folder/device_mb.txt" &
    sampler=$!
    trap 'kill "$sampler" 2>/dev/null || true' EXIT
    device=(--device-memory "$folder/device_mb.txt")
fi
build/bin/defrec-soak "$@" >"$folder/samples.csv"
if [ -n "${sampler:-}" ]; then
    kill "$sampler"
fi
python3 scripts/soak/judge.py "$folder/samples.csv" "${device[@]}" --plot "$folder/plot.svg"
